"""What a recorder takes from the bus."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from onemap_shared import keys
from onemap_shared.messages import (
    AnsweredQuery,
    FeatureField,
    Heartbeat,
    MapDigest,
    MapRevision,
    RgbdFrame,
    SearchView,
    SimilarityRequest,
    TextEmbeddings,
)
from onemap_shared.transport import Counters, Subscription
from onemap_tools.bag.bag_file import BagMessage, BagReader
from onemap_tools.bag.recorded_topics import FRAMES_HELD
from onemap_tools.bag.recorder import BagRecorder, subscribed
from tests.gateway import fakes
from tests.mapper import scenes
from tests.tools.bag.bags import RecordedRobot, embedded


@pytest.fixture
def robot(tmp_path: Path) -> RecordedRobot:
    made = RecordedRobot(tmp_path)
    made.begin()
    return made


def on(path: Path, key: str) -> list[BagMessage]:
    return [message for message in BagReader(path).messages() if message.topic == key]


def test_what_was_consumed_is_in_the_bag(robot: RecordedRobot) -> None:
    robot.see(0, 1, 2)
    path = robot.end()
    frames = [message.decode(RgbdFrame) for message in on(path, "robot/rgbd/v1")]
    fields = [message.decode(FeatureField) for message in on(path, "perception/field/v1")]
    revisions = [message.decode(MapRevision) for message in on(path, "map/revision/v1")]
    assert [frame.rgb[0, 0, 0] for frame in frames] == [0, 1, 2]
    assert [field.sequence for field in fields] == [0, 1, 2]
    assert [revision.frames_fused for revision in revisions] == [1, 2, 3]
    (digest,) = on(path, "map/digest/v1")
    assert digest.decode(MapDigest).frames_fused == 3
    assert robot.recorder.recorded["robot/rgbd/v1"] == 3
    assert robot.recorder.missed == {}


def stamps(path: Path, key: str, message: type[FeatureField] | type[MapRevision]) -> set[int]:
    return {each.decode(message).stamp_ns for each in on(path, key)}


class Emptied:
    """A subscription; something happens once all that it holds is taken."""

    def __init__(self, wrapped: Subscription[Any], then: Callable[[], None]) -> None:
        self._wrapped = wrapped
        self._then = [then]

    def take(self, timeout_s: float) -> Any:
        message = self._wrapped.take(timeout_s)
        if message is None and self._then:
            self._then.pop()()
        return message

    @property
    def counters(self) -> Counters:
        return self._wrapped.counters


def test_no_revision_is_recorded_without_its_features(robot: RecordedRobot) -> None:
    """The last frame arrives and is fused while the recorder goes from topic to topic."""
    bus = robot.router.bus("recorder")
    streams = [
        (topic, Emptied(stream, lambda: robot.see(1)) if topic is keys.FIELD else stream)
        for topic, stream in subscribed(bus, images=True)
    ]
    robot.recorder = BagRecorder(bus, streams, robot.writer)
    robot.see(0)
    path = robot.end()
    fused = stamps(path, "map/revision/v1", MapRevision)
    assert fused
    assert fused <= stamps(path, "perception/field/v1", FeatureField)


def test_a_recording_is_whole_with_the_features_of_its_map(robot: RecordedRobot) -> None:
    whole = [robot.recorder.whole]
    robot.bus.publish(keys.MAP_REVISION).put(fakes.revision(1))
    robot.update(digest=False)
    whole.append(robot.recorder.whole)
    late = replace(scenes.field(0, scenes.pose(0.0, 0.0, 0.0)), stamp_ns=fakes.STAMP_NS)
    robot.bus.publish(keys.FIELD).put(late)
    robot.update(digest=False)
    whole.append(robot.recorder.whole)
    assert whole == [True, False, True]


def test_images_can_be_left_out(tmp_path: Path) -> None:
    robot = RecordedRobot(tmp_path, images=False)
    robot.begin()
    robot.see(0)
    path = robot.end()
    assert on(path, "robot/rgbd/v1") == []
    assert len(on(path, "perception/field/v1")) == 1


def test_what_was_missed_is_counted(robot: RecordedRobot) -> None:
    robot.see(*range(FRAMES_HELD + 3), fused=False)
    robot.see(FRAMES_HELD + 8, fused=False)
    robot.end()
    assert robot.recorder.missed == {"robot/rgbd/v1": 5, "perception/field/v1": 4}


def test_heartbeats_keep_the_key_of_their_service(robot: RecordedRobot) -> None:
    beat = Heartbeat("mapper", "a1", 5, 1, True, "", {"cells": 2.0})
    robot.bus.publish(keys.heartbeat("mapper")).put(beat)
    (message,) = on(robot.end(), "health/mapper/heartbeat/v1")
    assert message.decode(Heartbeat) == beat


def test_without_a_mapper_the_rest_is_recorded(robot: RecordedRobot) -> None:
    robot.see(0, fused=False)
    robot.mapper_bus.close()
    path = robot.end()
    assert len(on(path, "perception/field/v1")) == 1
    assert "no process serves map/digest/v1" in robot.recorder.problems["map/digest/v1"]


def test_what_is_sought_is_recorded_with_its_embedding_once(robot: RecordedRobot) -> None:
    robot.router.bus("perception").serve(keys.EMBED_TEXT, embedded)
    states = robot.bus.publish(keys.SEARCH_STATE)
    for objects in (("sofa",), ("sofa",), ("sofa", "bed")):
        states.put(fakes.search(objects=objects))
    path = robot.end()
    asked = [each.decode(TextEmbeddings).texts for each in on(path, "perception/embed_text/v1")]
    assert asked == [("sofa",), ("bed",)]


def test_a_text_that_is_only_asked_for_is_recorded_with_its_embedding(robot: RecordedRobot) -> None:
    robot.router.bus("perception").serve(keys.EMBED_TEXT, embedded)
    robot.see(0)
    client = robot.router.bus("gateway")
    for _ in range(2):
        client.call(keys.MAP_SIMILARITY, SimilarityRequest("sofa", negatives=("bed",)))
    path = robot.end()
    asked = [each.decode(AnsweredQuery) for each in on(path, "map/queries/v1")]
    assert [(each.text, each.negatives, each.revision) for each in asked] == [
        ("sofa", ("bed",), 1)
    ] * 2
    (texts,) = (each.decode(TextEmbeddings).texts for each in on(path, "perception/embed_text/v1"))
    assert texts == ("sofa", "bed")


def test_a_snapshot_shows_the_map_and_what_is_sought(robot: RecordedRobot) -> None:
    robot.router.bus("perception").serve(keys.EMBED_TEXT, embedded)
    robot.see(0, 1)
    robot.update()
    robot.recorder.snapshot(robot.now_ns)
    robot.bus.publish(keys.SEARCH_STATE).put(fakes.search(objects=("sofa",)))
    robot.update()
    robot.recorder.snapshot(robot.now_ns)
    empty, sought = (
        message.decode(SearchView) for message in on(robot.end(), "map/search_view/v1")
    )
    assert (empty.text, empty.similarity.size) == ("", 0)
    assert sought.text == "sofa"
    assert np.isfinite(sought.similarity).any()
    assert (sought.occupancy != 0).any()


def test_without_perception_the_text_is_a_problem_and_the_rest_recorded(
    robot: RecordedRobot,
) -> None:
    robot.bus.publish(keys.SEARCH_STATE).put(fakes.search(objects=("sofa",)))
    assert len(on(robot.end(), "search/state/v1")) == 1
    assert "no process serves" in robot.recorder.problems["perception/embed_text/v1"]
