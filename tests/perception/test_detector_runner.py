"""The detector beside the encoder: nothing waits for it, and nothing old is told."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np

from onemap_perception.detectors.protocol import Detection, DetectorError, Image
from onemap_perception.service import Perception, PerceptionComponents
from onemap_perception.variance import VarianceParams
from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import Detections, SearchState, TextEmbeddings
from tests.perception.test_service import SEARCH
from tests.perception.toy import ColourEncoder, frame

PATIENCE = 1000  # steps of 10 ms that a test waits for a thread


class Held:
    """Finds one thing in every frame, once it is let go."""

    detector_id = "held"
    reads_features = False

    def __init__(self) -> None:
        self.let_go = threading.Event()
        self.broken = False

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        assert image.features is None
        assert self.let_go.wait(20)
        if self.broken:
            raise DetectorError("the weights are tired")
        return (Detection(names.texts[0], 0.9, (0, 0, 8, 8), np.ones((1, 1), bool)),)


class World:
    """Perception with a detector that takes its time."""

    def __init__(self) -> None:
        hub = MemoryRouter()
        outside = hub.bus()
        self.detector = Held()
        parts = PerceptionComponents(
            ColourEncoder(), self.detector, VarianceParams(), frame_timeout_s=5.0
        )
        self.service = Perception(hub.bus("perception"), parts)
        self.camera = outside.publish(keys.ROBOT_RGBD)
        self.planner = outside.publish(keys.SEARCH_STATE)
        self.fields = outside.subscribe(keys.FIELD)
        self.detections = outside.subscribe(keys.DETECTIONS)
        self.planner.put(SEARCH)
        self.ended = (0.0, 0.0)

    def show(self, sequence: int) -> None:
        self.camera.put(frame(sequence))
        self.service.step(0.0)

    def metric(self, name: str) -> float:
        return (self.service.health().metrics or {}).get(name, 0.0)

    def waited(self) -> Detections | None:
        """What comes once the detector is let go; None if it ends with nothing to tell."""
        self.detector.let_go.set()
        for _ in range(PATIENCE):
            self.service.step(0.01)
            ended = self.metric("detect_ms"), self.metric("detections_failed")
            if ended != self.ended:
                self.ended = ended
                return self.detections.take(0.0)
        raise AssertionError("the detector did not end")


def test_the_map_does_not_wait_for_the_detector() -> None:
    world = World()
    for sequence in (1, 2, 3):
        world.show(sequence)
        field = world.fields.take(0.0)
        assert field is not None
        assert field.sequence == sequence
    assert world.metric("detections_skipped") == 2
    assert world.detections.take(0.0) is None
    seen = world.waited()
    assert seen is not None
    assert (seen.sequence, seen.names) == (1, ("red",))
    world.show(4)
    again = world.waited()
    assert again is not None
    assert again.sequence == 4
    world.service.close()


def test_what_nobody_seeks_any_more_is_not_told() -> None:
    world = World()
    world.show(1)
    world.planner.put(replace(SEARCH, state=SearchState.CANCELLED))
    assert world.waited() is None
    assert world.metric("detect_ms") > 0
    world.service.close()


def test_a_failing_detector_costs_no_field() -> None:
    world = World()
    world.detector.broken = True
    world.show(1)
    assert world.waited() is None
    assert world.fields.take(0.0) is not None
    assert world.metric("detections_failed") == 1
    assert world.metric("frames_failed") == 0
    problem = world.service.health().problem
    assert problem == "nothing can be detected: the weights are tired"
    world.detector.broken = False
    world.show(2)
    seen = world.waited()
    assert seen is not None
    assert world.service.health().problem == ""
    world.detector.broken = True
    world.show(3)
    assert world.waited() is None
    world.planner.put(replace(SEARCH, state=SearchState.CANCELLED))
    world.service.step(0.0)
    assert world.service.health().problem == ""  # nothing is to be detected any more
    world.service.close()
