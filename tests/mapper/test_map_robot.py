"""One map of two robots on the in-memory bus: each its own frames, order, search and heartbeat."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import pytest

from onemap_mapper.belief.version import FrameHistory
from onemap_mapper.config import MapperConfig
from onemap_mapper.robots import FrameOrder, MapRobot
from onemap_mapper.service import Mapper, build
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.geometry import F64, camera_mount, pose_2d
from onemap_shared.runner import StartError
from onemap_shared.transport import RemoteError
from tests.mapper import scenes
from tests.mapper.finds import object_find
from tests.mapper.test_service import NEUTRAL, SOFA, sofa_ahead
from tests.memory_bus import MemoryBus, MemoryRouter

S = 10**9
BEHIND = np.pi  # what robot 2 sees, and robot 1 does not


class Robot:
    """What surrounds the mapper under the keys of one robot: its perception and its planner."""

    def __init__(self, router: MemoryRouter) -> None:
        self.bus: MemoryBus = router.bus("planner")
        self.fields = self.bus.publish(keys.FIELD)
        self.revisions = self.bus.subscribe(keys.MAP_REVISION, capacity=100)
        self.heartbeats = self.bus.subscribe(keys.heartbeat("mapper"), capacity=100)
        self.perception = router.bus("perception")
        self.perception.serve(keys.EMBED_TEXT, embedded)

    def view(self, text: str = "") -> m.SearchView:
        return self.bus.call(keys.MAP_SEARCH_VIEW, m.SearchViewRequest(text))

    def searched(self) -> int:
        """Cells that this robot has searched."""
        return int((self.view().layers & m.Layer.SEARCHED > 0).sum())

    def reset(self) -> None:
        self.bus.call(keys.MAP_SEARCH_RESET, m.SearchReset("s"))

    def newest(self) -> m.MapRevision:
        found = None
        while (message := self.revisions.take(0.0)) is not None:
            found = message
        assert found is not None
        return found

    def heartbeat(self) -> m.Heartbeat:
        found = None
        while (message := self.heartbeats.take(0.0)) is not None:
            found = message
        assert found is not None
        return found


class Fleet:
    """A mapper under the keys of r1 that shares its map with r2."""

    def __init__(self, folder: Path) -> None:
        self.site = MemoryRouter()
        own = self.site.space("fleet/r1")
        own.namespaces = self.site.namespaces  # one router has them all
        config = MapperConfig(map_folder=folder, robots=("fleet/r1", "fleet/r2"))
        self.r1, self.r2 = Robot(own), Robot(self.site.space("fleet/r2"))
        self.mapper: Mapper = build(own.bus("mapper"), config)

    def step(self) -> None:
        self.mapper.step(0.0)

    def feed(self, robot: Robot, *fields: m.FeatureField) -> None:
        for field in fields:
            robot.fields.put(field)
            self.step()


@pytest.fixture
def fleet(tmp_path: Path) -> Iterator[Fleet]:
    made = Fleet(tmp_path / "maps")
    yield made
    made.mapper.close()


def embedded(request: m.TextRequest) -> m.TextEmbeddings:
    return m.TextEmbeddings(
        "encoder-a",
        "space-a",
        request.texts,
        np.tile(SOFA, (len(request.texts), 1)),
        NEUTRAL,
        np.ones((len(request.texts), 2), np.uint8),
        30.0,
        0.0,
    )


def frame(sequence: int, stamp_ns: int, yaw_rad: float = 0.0, x_m: float = 0.0) -> m.FeatureField:
    """A frame on the clock of its robot."""
    made = scenes.field(sequence, scenes.pose(x_m, 0.0, yaw_rad))
    return replace(made, stamp_ns=stamp_ns)


def test_a_slower_robot_whose_clock_and_count_are_behind_is_not_late(fleet: Fleet) -> None:
    for k in range(6):
        fleet.feed(fleet.r1, frame(1000 + k, 100 * S + k * S // 8))
        if k % 3 == 0:
            fleet.feed(fleet.r2, frame(k, 99 * S + k * S // 8, BEHIND))
    assert fleet.r1.newest().frames_fused == 8
    counts = [fleet.mapper._health(robot).metrics or {} for robot in robots(fleet)]
    assert [each["frames_late"] for each in counts] == [0, 0]
    assert [each["robot_frames_fused"] for each in counts] == [6, 2]


def test_both_robots_search_at_once_each_with_its_own_searched_layer(fleet: Fleet) -> None:
    fleet.feed(fleet.r1, *(frame(k, 100 * S + k, x_m=0.1 * k) for k in range(8)))
    fleet.feed(fleet.r2, *(frame(k, 50 * S + k, BEHIND, -0.1 * k) for k in range(8)))
    before = fleet.r1.searched(), fleet.r2.searched()
    assert min(before) > 50
    both = (fleet.r1.view().layers & fleet.r2.view().layers & m.Layer.SEARCHED) > 0
    assert both.sum() < 0.5 * min(before)  # they looked the other way
    fleet.r2.reset()
    assert (fleet.r1.searched(), fleet.r2.searched()) == (before[0], 0)
    explored = fleet.r2.view().layers & m.Layer.EXPLORED > 0
    assert explored.sum() >= max(before)  # of both
    fleet.feed(fleet.r2, frame(9, 51 * S, BEHIND))
    fleet.r1.reset()
    assert fleet.r1.searched() == 0


def test_finds_of_one_robot_are_the_others_and_the_map_is_shared(fleet: Fleet) -> None:
    fleet.feed(fleet.r1, frame(0, 100 * S))
    fleet.r1.bus.call(keys.MAP_REMEMBER, object_find("sofa"))
    fleet.r2.bus.call(keys.MAP_REMEMBER, object_find("bed"))
    finders = [("bed", "fleet/r2"), ("sofa", "fleet/r1")]
    assert found_by(fleet.r2) == finders
    assert fleet.r2.newest().objects_version == fleet.r1.newest().objects_version > 0
    fleet.r2.bus.call(keys.MAP_SAVE, m.MapFile("flat"))
    fleet.r2.bus.call(keys.MAP_CLEAR, m.MapClear())
    assert fleet.r1.newest().frames_fused == 0
    assert found_by(fleet.r1) == []
    fleet.r1.bus.call(keys.MAP_LOAD, m.MapFile("flat"))
    assert fleet.r2.newest().frames_fused == 1
    assert found_by(fleet.r1) == finders
    fleet.r2.bus.call(keys.MAP_REMEMBER, object_find("sofa", stamp_ns=200))
    assert found_by(fleet.r1) == [("sofa", "fleet/r2"), ("bed", "fleet/r2")]


def found_by(robot: Robot) -> list[tuple[str, str]]:
    """Name and finder of each object that the robot is told of."""
    listed = robot.bus.call(keys.MAP_OBJECTS, m.ObjectListRequest())
    return [(kept.name, kept.robot) for kept in listed.objects]


def test_each_robot_is_told_what_its_camera_has_in_its_image(fleet: Fleet) -> None:
    def mounted(height_m: float, down_deg: float, roll_deg: float = 0.0) -> F64:
        T_map_camera = pose_2d(0.2, 0.1, 2.0) @ camera_mount(0.1, height_m, np.deg2rad(down_deg))
        return scenes.rolled(T_map_camera, np.deg2rad(roll_deg))

    half_deg = np.degrees(np.arctan(scenes.SIZE[0] / 2 / scenes.CAMERA.fy))
    fleet.feed(fleet.r1, scenes.field(1, mounted(0.4, 0.0)))
    assert fleet.r2.newest().camera == ()
    fleet.feed(fleet.r2, scenes.field(1, mounted(1.3, 50.0)))
    for robot, expected in (
        (fleet.r1, (0.4, half_deg, half_deg, 90.0)),
        (fleet.r2, (1.3, half_deg + 50, half_deg - 50, 90.0)),
    ):
        (camera,) = robot.newest().camera
        assert astuple(camera) == pytest.approx(expected)
    fleet.feed(fleet.r1, scenes.field(2, mounted(0.4, 0.0, roll_deg=90.0)))
    (upright,) = fleet.r1.newest().camera
    assert astuple(upright) == pytest.approx((0.4, 45.0, 45.0, 2 * half_deg))


def test_a_silent_robot_is_unwell_alone(fleet: Fleet) -> None:
    fleet.feed(fleet.r1, frame(0, 100 * S))
    assert fleet.mapper.health().ready
    beat = fleet.r2.heartbeat()
    assert (beat.service, beat.ready) == ("mapper", False)
    assert "waiting for the first frame" in beat.problem
    assert fleet.r2.bus.members() >= {("mapper", beat.instance)}
    fleet.feed(fleet.r2, frame(0, 5 * S, BEHIND))
    assert fleet.mapper._health(robots(fleet)[1]).ready


def test_words_are_looked_up_by_the_robots_own_perception(fleet: Fleet) -> None:
    fleet.feed(fleet.r1, sofa_ahead(0))
    fleet.r1.perception.close()
    assert np.nanmax(fleet.r2.view("sofa").similarity) > 0.9
    with pytest.raises(RemoteError, match="perception does not run"):
        fleet.r1.view("sofa")


def test_a_robot_that_begins_anew_elsewhere_is_left_out_until_the_map_is(fleet: Fleet) -> None:
    fleet.feed(fleet.r1, frame(50, 100 * S))
    fleet.feed(fleet.r2, frame(50, 100 * S, x_m=1.5), frame(51, 101 * S, x_m=1.5))
    fleet.feed(fleet.r2, frame(0, 120 * S), frame(1, 121 * S))
    assert fleet.r2.newest().frames_fused == 3
    first, second = (fleet.mapper._health(robot) for robot in robots(fleet))
    assert first.ready
    assert "fleet/r2 counts its frames anew 1.5 m from where it was" in second.problem
    fleet.feed(fleet.r1, frame(0, 122 * S))  # this one only began to count anew
    assert fleet.r1.newest().frames_fused == 4
    fleet.r1.bus.call(keys.MAP_CLEAR, m.MapClear())
    fleet.feed(fleet.r2, frame(2, 123 * S))
    assert fleet.r2.newest().frames_fused == 1
    assert fleet.mapper._health(robots(fleet)[1]).problem == ""


def test_a_robot_in_another_world_is_left_out_of_a_shared_map(fleet: Fleet) -> None:
    flat, office = (replace(frame(0, 100 * S), world=name) for name in ("flat", "office"))
    fleet.feed(fleet.r1, flat)
    fleet.feed(fleet.r2, office)
    assert "r2 is in world 'office'" in fleet.mapper._health(robots(fleet)[1]).problem
    assert fleet.r1.newest().frames_fused == 1
    for k in (1, 2):  # both are there now
        fleet.feed(fleet.r1, replace(office, sequence=k, stamp_ns=(100 + k) * S))
    assert "another world (fleet/r1/flat)" in fleet.mapper._health(robots(fleet)[0]).problem


def test_a_robot_that_has_a_mapper_of_its_own_is_not_shared(tmp_path: Path) -> None:
    site = MemoryRouter()
    site.space("fleet/r2").bus("mapper")
    config = MapperConfig(map_folder=tmp_path, robots=("fleet/r2",))
    with pytest.raises(StartError, match="under the keys of fleet/r2") as refused:
        build(site.bus("mapper"), config)
    assert refused.value.temporary


def robots(fleet: Fleet) -> tuple[MapRobot, ...]:
    return fleet.mapper._robots


NEWEST = FrameHistory(50, 100 * S)


@pytest.mark.parametrize(
    ("sequence", "stamp_ns", "late"),
    [
        (51, 101 * S, False),
        (49, 99 * S, True),
        (51, 91 * S, False),  # the clock was set back by 9 s
        (0, 101 * S, False),  # the robot was started again
        (0, 40 * S, False),  # another recording
        (50, 100 * S, False),  # a recording of one frame, repeated
    ],
)
def test_a_frame_is_late_by_sequence_and_time(sequence: int, stamp_ns: int, late: bool) -> None:
    assert FrameOrder().is_late(sequence, stamp_ns, NEWEST) is late
