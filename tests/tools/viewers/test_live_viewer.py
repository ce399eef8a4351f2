"""What a viewer gets of what travels on the bus."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

pytest.importorskip("foxglove", reason="needs foxglove-sdk: pip install 'onemap[live]'")

from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import (
    ObjectList,
    SearchState,
    SearchView,
    SearchViewRequest,
    VelocityCommand,
)
from onemap_tools.viewers import foxglove_topics as topics
from onemap_tools.viewers.live_viewer import MAP_EVERY_S, REPEAT_S, LiveViewer
from tests.gateway import fakes
from tests.shared.samples import KEPT
from tests.tools.viewers.foxglove_client import read


class FakeServer:
    """Keeps what is sent, and refuses what nobody wants."""

    def __init__(self) -> None:
        self.query = ""
        self.subscribed = {*topics.TYPED, *topics.JSON}
        self.sent: list[tuple[str, Any]] = []

    def wanted(self, topic: str) -> bool:
        return topic in self.subscribed

    def send(self, topic: str, message: Any, now_ns: int) -> None:
        assert self.wanted(topic)
        self.sent.append((topic, message))

    def take(self, topic: str) -> list[Any]:
        """The messages on a topic so far, and forget all."""
        found = [message for name, message in self.sent if name == topic]
        self.sent.clear()
        return found


class Robot:
    """A bus with a mapper that answers, and a viewer on it."""

    def __init__(self) -> None:
        self.router = MemoryRouter()
        self.server = FakeServer()
        self.asked: list[str] = []
        self.bus = self.router.bus("robot")
        self.viewer = LiveViewer(self.router.bus("viewer"), self.server)
        self.now_s = 0.0

    def with_mapper(self) -> Robot:
        def view(request: SearchViewRequest) -> SearchView:
            self.asked.append(request.text)
            return fakes.search_view(request.text)

        self.bus.serve(keys.MAP_SEARCH_VIEW, view)
        self.bus.serve(keys.MAP_OBJECTS, lambda _: ObjectList((KEPT,)))
        return self

    def publish(self, topic: Any, *messages: Any) -> None:
        publisher = self.bus.publish(topic)
        for message in messages:
            publisher.put(message)

    def update(self, after_s: float = 0.01) -> None:
        self.now_s += after_s
        self.viewer.update(self.now_s, fakes.STAMP_NS + int(self.now_s * 1e9))


@pytest.fixture
def robot() -> Robot:
    return Robot()


PASSED_ON: dict[str, tuple[Any, Any, str]] = {
    "image": (keys.ROBOT_RGBD, fakes.rgbd(), topics.IMAGE),
    "points": (keys.ROBOT_RGBD, fakes.rgbd(), topics.POINTS),
    "calibration": (keys.ROBOT_RGBD, fakes.rgbd(), topics.CALIBRATION),
    "camera": (keys.ROBOT_RGBD, fakes.rgbd(), topics.TRANSFORMS),
    "body": (keys.ROBOT_ODOMETRY, fakes.odometry(1.0, 2.0), topics.TRANSFORMS),
    "robot": (keys.ROBOT_ODOMETRY, fakes.odometry(1.0, 2.0), topics.ROBOT),
    "motion": (keys.ROBOT_ODOMETRY, fakes.odometry(1.0, 2.0), topics.MOTION),
    "command": (keys.ROBOT_CMD_VEL, VelocityCommand(1, 1, 0.2, 0.1), topics.COMMAND),
    "boxes": (keys.DETECTIONS, fakes.detections("sofa"), topics.BOXES),
    "detected": (keys.DETECTIONS, fakes.detections("sofa"), topics.DETECTED),
    "revision": (keys.MAP_REVISION, fakes.revision(3), topics.MAP_STATE),
    "search": (keys.SEARCH_STATE, fakes.search(), topics.SEARCH),
    "plan": (keys.SEARCH_PATH, fakes.planned_path((0.0, 0.0)), topics.PLAN),
    "health": (keys.heartbeat("mapper"), fakes.heartbeat("mapper"), topics.service_topic("mapper")),
}


@pytest.mark.parametrize("case", PASSED_ON)
def test_a_message_is_passed_on(robot: Robot, case: str) -> None:
    stream, message, topic = PASSED_ON[case]
    robot.update()  # nothing is repeated after it for a while
    robot.publish(stream, message)
    robot.update()
    assert len(robot.server.take(topic)) == 1


@pytest.mark.parametrize("case", PASSED_ON)
def test_what_nobody_wants_is_not_made(robot: Robot, case: str) -> None:
    robot.server.subscribed.clear()
    stream, message, _ = PASSED_ON[case]
    robot.publish(stream, message)
    robot.update()
    assert robot.server.sent == []


def test_the_map_is_asked_for_once_per_change(robot: Robot) -> None:
    robot.with_mapper()
    robot.publish(keys.MAP_REVISION, fakes.revision(3))
    robot.update()
    assert len(robot.server.take(topics.OCCUPANCY)) == 1
    robot.update(MAP_EVERY_S)
    assert robot.server.take(topics.OCCUPANCY) == []
    robot.publish(keys.MAP_REVISION, fakes.revision(4))
    robot.update(MAP_EVERY_S)
    assert len(robot.server.take(topics.OCCUPANCY)) == 1


def test_a_viewer_that_comes_later_gets_the_map_too(robot: Robot) -> None:
    robot.with_mapper().update()
    robot.server.take(topics.OCCUPANCY)
    robot.update(REPEAT_S)
    assert len(robot.server.take(topics.OCCUPANCY)) == 1


@pytest.mark.parametrize(("query", "text"), [("", "sofa"), ("bed", "bed")])
def test_the_similarity_is_that_of_the_query_or_of_the_search(
    robot: Robot, query: str, text: str
) -> None:
    robot.with_mapper().server.query = query
    robot.publish(keys.SEARCH_STATE, fakes.search(objects=("sofa",)))
    robot.update()
    assert robot.asked == [text]
    assert len(robot.server.take(topics.SIMILARITY)) == 1


def test_found_objects_are_shown(robot: Robot) -> None:
    robot.with_mapper().update()
    (scene,) = robot.server.take(topics.OBJECTS)
    assert read(scene).entities[0].texts[0].text.startswith("bed")


def test_without_a_mapper_the_log_says_so_once(robot: Robot) -> None:
    robot.update()
    robot.update(REPEAT_S)
    lines = [read(line) for line in robot.server.take(topics.LOG)]
    assert sorted(line.name for line in lines) == ["map", "objects"]
    assert all("no " in line.message.lower() for line in lines)


def test_the_plan_goes_when_the_search_ends(robot: Robot) -> None:
    robot.publish(keys.SEARCH_PATH, fakes.planned_path((0.0, 0.0), (1.0, 0.0)))
    robot.publish(keys.DETECTIONS, fakes.detections("sofa"))
    robot.update()
    robot.server.sent.clear()
    robot.publish(keys.SEARCH_STATE, fakes.search(state=SearchState.FOUND))
    robot.update()
    sent = dict(robot.server.sent)
    path = next(entity for entity in read(sent[topics.PLAN]).entities if entity.id == "path")
    assert len(path.lines[0].points) == 0
    assert len(read(sent[topics.BOXES]).points) == 0


def test_a_problem_is_logged_when_it_begins_and_when_it_ends(robot: Robot) -> None:
    beats: list[Callable[[], Any]] = [
        lambda: fakes.heartbeat("mapper", 1, problem="no frames"),
        lambda: fakes.heartbeat("mapper", 2, problem="no frames"),
        lambda: fakes.heartbeat("mapper", 3),
    ]
    for beat in beats:
        robot.publish(keys.heartbeat("mapper"), beat())
        robot.update()
    lines = [read(message) for topic, message in robot.server.sent if topic == topics.LOG]
    assert [line.message for line in lines if line.name == "mapper"] == ["no frames", "is well"]
