"""Perception on the bus: fields and detections of frames, and failures."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from onemap_perception.detectors.patches import PatchDetector
from onemap_perception.detectors.protocol import Detection, Image
from onemap_perception.encoders.protocol import ImageEncoder
from onemap_perception.errors import BackendError, OutOfDeviceMemoryError
from onemap_perception.feature_field import VarianceParams
from onemap_perception.service import MAX_FAILED_IN_ROW, Perception, PerceptionComponents
from onemap_shared import keys
from onemap_shared.geometry import F16, U8
from onemap_shared.messages import (
    Detections,
    ImageRequest,
    SearchState,
    SearchStatus,
    TextEmbeddings,
    TextRequest,
)
from onemap_shared.runner import WorkerFailed
from onemap_shared.transport import RemoteError
from tests.memory_bus import MemoryBus, MemoryRouter
from tests.perception.encoders.test_images import png
from tests.perception.toy import ColourEncoder, frame


class SlowDetector:
    """Implements ``Detector``: one detection per frame, or an error, once ``finish`` is set."""

    detector_id = "slow"
    reads_features = False

    def __init__(self) -> None:
        self.finish = threading.Event()
        self.broken = False

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        assert image.features is None
        assert self.finish.wait(60)
        if self.broken:
            raise BackendError("the weights are damaged")
        return (Detection(names.texts[0], 0.9, (0, 0, 8, 8), np.ones((1, 1), bool)),)


SEARCH = SearchStatus(
    search_id="s1",
    state=SearchState.EXPLORING,
    objects=("red", "blue", "mauve"),
    index=0,
    reason="",
    results=(),
    started_ns=0,
    updated_ns=0,
    path_length_m=0.0,
)


class World:
    """A perception service and its neighbours on one bus."""

    def __init__(self, encoder: ImageEncoder | None = None) -> None:
        self.router = MemoryRouter()
        self.outside: MemoryBus = self.router.bus()
        parts = PerceptionComponents(
            encoder or ColourEncoder(),
            PatchDetector("toy"),
            VarianceParams(),
        )
        self.service = Perception(self.router.bus("perception"), parts)
        self.camera = self.outside.publish(keys.ROBOT_RGBD)
        self.planner = self.outside.publish(keys.SEARCH_STATE)
        self.fields = self.outside.subscribe(keys.FIELD)
        self.detections = self.outside.subscribe(keys.DETECTIONS)


@pytest.fixture
def world() -> World:
    return World()


def test_while_a_search_runs_every_frame_is_looked_at_for_its_target(world: World) -> None:
    world.planner.put(SEARCH)
    world.camera.put(frame(1))
    world.service.step(0.0)
    seen = world.detections.take(0.0)
    assert seen is not None
    assert seen.names == ("red",)
    assert seen.detector_id == "patches/toy"
    assert len(seen.points_map) > 0
    assert seen.picture
    world.planner.put(replace(SEARCH, index=1))
    world.camera.put(frame(2))
    world.service.step(0.0)
    other = world.detections.take(0.0)
    assert other is not None
    assert (other.sequence, other.names) == (2, ("red",))  # a rival keeps its own name
    assert not other.picture
    world.planner.put(replace(SEARCH, state=SearchState.FOUND))
    world.camera.put(frame(3))
    world.service.step(0.0)
    assert world.detections.take(0.0) is None


def test_texts_are_embedded_by_one_thread_at_a_time() -> None:
    together, inside = threading.Barrier(4), threading.Lock()

    class OneAtATime(ColourEncoder):
        def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
            assert inside.acquire(blocking=False)
            try:
                time.sleep(0)  # lets another thread run
                return super().embed_text(texts)
            finally:
                inside.release()

    service = World(OneAtATime()).service

    def ask(_: int) -> int:
        together.wait(60)
        return len([service.embed_text(TextRequest(("red",))) for _ in range(50)])

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(ask, range(4))) == [50] * 4


def test_a_search_that_began_before_perception_is_followed() -> None:
    router = MemoryRouter()
    router.bus().publish(keys.SEARCH_STATE).put(SEARCH)
    world = World.__new__(World)
    world.router = router
    parts = PerceptionComponents(ColourEncoder(), PatchDetector("toy"), VarianceParams())
    service = Perception(router.bus("perception"), parts)
    detections = router.bus().subscribe(keys.DETECTIONS)
    router.bus().publish(keys.ROBOT_RGBD).put(frame())
    service.step(0.0)
    seen = detections.take(0.0)
    assert seen is not None
    assert seen.names == ("red",)


def test_a_target_nobody_can_embed_is_a_problem_and_no_crash(world: World) -> None:
    world.planner.put(replace(SEARCH, index=2))
    world.camera.put(frame(1))
    world.service.step(0.0)
    seen = world.detections.take(0.0)
    assert seen is not None
    assert seen.names == ()
    assert world.service.health().problem == "'mauve' is no colour"
    world.planner.put(replace(SEARCH, state=SearchState.CANCELLED))
    world.service.step(0.0)
    assert world.service.health().problem == ""


def test_text_is_embedded_for_others(world: World) -> None:
    reply = world.outside.call(keys.EMBED_TEXT, TextRequest(("blue", " red ")))
    assert reply.texts == ("blue", "red")
    np.testing.assert_array_equal(reply.embeddings, np.eye(3, dtype=np.float32)[[2, 0]])
    with pytest.raises(RemoteError, match="'mauve' is no colour") as refusal:
        world.outside.call(keys.EMBED_TEXT, TextRequest(("mauve",)))
    assert refusal.value.code == "unknown_word"
    assert refusal.value.details == {"words": [{"word": "mauve", "did_you_mean": ["blue"]}]}


def test_ready_means_that_a_frame_was_encoded(world: World) -> None:
    assert not world.service.health().ready
    world.camera.put(frame())
    world.service.step(0.0)
    health = world.service.health()
    assert health.ready
    assert health.problem == ""
    metrics = health.metrics or {}
    assert {"encode_ms", "detect_ms", "frames_per_s"} <= set(metrics)
    assert metrics["frames_per_s"] == 0  # one frame has no rate
    world.camera.put(frame(2))
    world.service.step(0.0)
    assert (world.service.health().metrics or {})["frames_per_s"] > 0
    world.service.close()


def constant(height: int, width: int, value: int = 0) -> U8:
    return np.full((height, width, 3), value, np.uint8)


def test_a_frame_that_breaks_the_encoder_is_dropped_and_the_next_one_is_not(world: World) -> None:
    world.camera.put(frame(1, rgb=constant(8, 8) + np.array([1, 2, 3], np.uint8)))
    world.service.step(0.0)
    assert world.fields.take(0.0) is None
    health = world.service.health()
    assert "this image breaks the toy" in health.problem
    assert (health.metrics or {})["frames_failed"] == 1
    world.camera.put(frame(2))
    world.service.step(0.0)
    assert world.fields.take(0.0) is not None
    assert world.service.health().problem == ""


class SlowWorld:
    """Perception with a detector in a thread of its own, and a search."""

    def __init__(self) -> None:
        router = MemoryRouter()
        outside = router.bus()
        self.detector = SlowDetector()
        components = PerceptionComponents(ColourEncoder(), self.detector, VarianceParams())
        self.service = Perception(router.bus("perception"), components)
        self.camera = outside.publish(keys.ROBOT_RGBD)
        self.planner = outside.publish(keys.SEARCH_STATE)
        self.fields = outside.subscribe(keys.FIELD)
        self.detections = outside.subscribe(keys.DETECTIONS)
        self.planner.put(SEARCH)
        self._ended = (0.0, 0.0)

    def show(self, sequence: int) -> None:
        self.camera.put(frame(sequence))
        self.service.step(0.0)

    def metric(self, name: str) -> float:
        return (self.service.health().metrics or {}).get(name, 0.0)

    def release(self) -> Detections | None:
        """The detections once the detector may finish; None if it ends without any."""
        self.detector.finish.set()
        for _ in range(1000):
            self.service.step(0.01)
            ended = self.metric("detect_ms"), self.metric("detections_failed")
            if ended != self._ended:
                self._ended = ended
                return self.detections.take(0.0)
        raise AssertionError("the detector did not end")


def test_the_map_does_not_wait_for_a_slow_detector() -> None:
    world = SlowWorld()
    for sequence in (1, 2, 3):
        world.show(sequence)
        field = world.fields.take(0.0)
        assert field is not None
        assert field.sequence == sequence
    assert world.metric("detections_skipped") == 2
    assert world.detections.take(0.0) is None
    seen = world.release()
    assert seen is not None
    assert (seen.sequence, seen.names) == (1, ("red",))
    world.show(4)
    again = world.release()
    assert again is not None
    assert again.sequence == 4
    world.service.close()


def test_a_failing_detector_does_not_stop_the_fields() -> None:
    world = SlowWorld()
    world.detector.broken = True
    world.show(1)
    assert world.release() is None
    assert world.fields.take(0.0) is not None
    assert world.metric("detections_failed") == 1
    assert world.metric("frames_failed") == 0
    problem = world.service.health().problem
    assert problem == "nothing can be detected: the weights are damaged"
    world.detector.broken = False
    world.show(2)
    seen = world.release()
    assert seen is not None
    assert world.service.health().problem == ""
    world.detector.broken = True
    world.show(3)
    assert world.release() is None
    world.planner.put(replace(SEARCH, state=SearchState.CANCELLED))
    world.service.step(0.0)
    assert world.service.health().problem == ""  # nothing is to be detected any more
    world.service.close()


class BrokenEncoder(ColourEncoder):
    """As after an error of CUDA; what it raises on each frame."""

    def __init__(self, raises: type[BackendError]) -> None:
        self.raises: type[BackendError] | None = raises

    def encode(self, rgb: U8) -> F16:
        if self.raises:
            raise self.raises("the network failed on cuda: an illegal memory access")
        return super().encode(rgb)


def shown(world: World, first: int, count: int) -> None:
    for sequence in range(first, first + count):
        world.camera.put(frame(sequence))
        world.service.step(0.0)


def test_an_encoder_that_fails_for_ever_ends_perception() -> None:
    """A full memory does not, and one frame that succeeds begins the count anew."""
    encoder = BrokenEncoder(OutOfDeviceMemoryError)
    world = World(encoder)
    shown(world, 0, 2 * MAX_FAILED_IN_ROW)
    assert (world.service.health().metrics or {})["out_of_memory"] == 2 * MAX_FAILED_IN_ROW
    encoder.raises = BackendError
    shown(world, 200, MAX_FAILED_IN_ROW - 1)
    encoder.raises = None
    shown(world, 300, 1)
    encoder.raises = BackendError
    shown(world, 400, MAX_FAILED_IN_ROW - 1)
    with pytest.raises(WorkerFailed, match=r"50 frames in a row .* an illegal memory access"):
        shown(world, 500, 1)


def test_a_detector_that_fails_for_ever_ends_perception() -> None:
    world = SlowWorld()
    world.detector.broken = True

    def look(sequence: int) -> None:
        world.show(sequence)
        world.release()

    for sequence in range(MAX_FAILED_IN_ROW - 1):
        look(sequence)
    with pytest.raises(WorkerFailed, match=r"detector failed on 50 .* the weights are damaged"):
        look(MAX_FAILED_IN_ROW)


def test_a_picture_is_embedded_as_the_encoder_sees_it() -> None:
    caller = World(ColourEncoder()).outside
    rgb = np.zeros((32, 48, 3), np.uint8)
    rgb[..., 1], rgb[..., 2] = 200, np.arange(48)
    query = caller.call(keys.EMBED_IMAGE, ImageRequest(png(rgb)))
    assert query.embeddings[0].argmax() == 1
    assert query.encoder_id == "toy"
    with pytest.raises(RemoteError, match="cut off") as refused:
        caller.call(keys.EMBED_IMAGE, ImageRequest(png(rgb)[:80]))
    assert refused.value.code == "bad_image"
