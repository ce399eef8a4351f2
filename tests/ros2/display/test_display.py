from __future__ import annotations

from onemap_ros2.cdr import GRID, MARKER_ARRAY, POSE_STAMPED, decode, stamp_ns
from onemap_ros2.config import Ros2Config
from onemap_ros2.display import TOPICS, Display
from onemap_shared.keys import (
    MAP_OBJECTS,
    MAP_REVISION,
    MAP_SEARCH_VIEW,
    SEARCH_PATH,
    SEARCH_STATE,
)
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import (
    MapRevision,
    ObjectList,
    ObjectListRequest,
    SearchState,
    SearchView,
    SearchViewRequest,
)
from tests.ros2.fake_network import FakeNetwork, FakeWriter
from tests.ros2.planner_messages import KEPT, path_to, status, view

CONFIG = Ros2Config.model_validate({"namespace": "/r1"})


class Screen:
    """A display between a mapper and a planner in memory and a robot's network in memory."""

    def __init__(self) -> None:
        router = MemoryRouter()
        self.mapper = router.bus("mapper")
        self.asked: list[str] = []
        self.mapper.serve(MAP_SEARCH_VIEW, self._view)
        self.mapper.serve(MAP_OBJECTS, self._objects)
        self.revisions = self.mapper.publish(MAP_REVISION)
        self.paths, self.states = (
            self.mapper.publish(SEARCH_PATH),
            self.mapper.publish(SEARCH_STATE),
        )
        self.network = FakeNetwork()
        self.display = Display(router.bus("ros2"), self.network, CONFIG, lambda: 77)

    def _view(self, request: SearchViewRequest) -> SearchView:
        self.asked.append(request.text)
        return view()

    def _objects(self, _: ObjectListRequest) -> ObjectList:
        self.asked.append("objects")
        return ObjectList((KEPT,))

    def writer(self, name: str) -> FakeWriter:
        return self.network.writers[f"/r1/onemap/{name}", TOPICS[name]]

    def revise(self, objects_version: int) -> None:
        self.revisions.put(MapRevision(1, 1, 1, "e", "t", 1, 1, 1, 1.0, 1.0, objects_version))


def test_all_topics_are_latched_and_in_the_namespace() -> None:
    screen = Screen()
    assert screen.network.latched == {f"/r1/onemap/{name}" for name in TOPICS}


def test_grids_show_the_present_object_at_a_bounded_rate() -> None:
    screen = Screen()
    screen.states.put(status("s1"))
    for step in range(30):
        screen.display.step(10.0 + 0.1 * step)
    assert screen.asked == ["sofa"] * 3
    assert len(screen.writer("belief").sent) == len(screen.writer("similarity").sent) == 3
    assert decode(screen.writer("belief").sent[0], GRID).info.width == 3


def test_nothing_is_asked_while_nobody_listens() -> None:
    screen = Screen()
    for writer in screen.network.writers.values():
        writer.heard = False
    screen.revise(1)
    screen.paths.put(path_to(2.0, 0.0))
    for step in range(30):
        screen.display.step(10.0 + 0.1 * step)
    assert screen.asked == []
    assert not any(writer.sent for writer in screen.network.writers.values())


def test_marks_follow_the_plan_and_the_objects_at_a_bounded_rate() -> None:
    screen = Screen()
    screen.writer("belief").heard = screen.writer("similarity").heard = False
    screen.states.put(status("s1"))
    screen.revise(1)
    for step in range(20):
        screen.paths.put(path_to(2.0, 0.0))
        screen.display.step(10.0 + 0.1 * step)
    assert screen.asked == ["objects"]  # the list has not changed since
    assert len(screen.writer("markers").sent) == 4  # 2 Hz for 2 s
    goal = decode(screen.writer("goal").sent[-1], POSE_STAMPED)
    assert (goal.pose.position.x, stamp_ns(goal.header.stamp)) == (2.0, 77)
    screen.revise(2)
    screen.states.put(status("s1", SearchState.FOUND))
    screen.display.step(20.0)
    markers = decode(screen.writer("markers").sent[-1], MARKER_ARRAY).markers
    assert {each.ns for each in markers} == {"", "finds"}  # the plan is over
    sent = len(screen.writer("markers").sent)
    screen.display.step(30.0)
    assert len(screen.writer("markers").sent) == sent  # nothing is new


def test_a_mapper_that_does_not_answer_is_asked_again() -> None:
    screen = Screen()
    screen.mapper.close()
    screen.revise(1)
    screen.display.step(10.0)
    screen.display.step(12.0)
    assert screen.display.grids == 0


def test_the_thread_ends() -> None:
    screen = Screen()
    screen.display.start()
    screen.display.close()
