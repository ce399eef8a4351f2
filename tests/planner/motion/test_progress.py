"""A robot that does not get on backs up and remembers what it ran into."""

import math

import numpy as np
import pytest

from onemap_planner.motion.motions import STOP, Pose2d
from onemap_planner.motion.progress import BACK_UP_S, MotionSample, ProgressMonitor, met_at
from onemap_planner.world.map_view import MapView
from onemap_shared.geometry import Velocity2d
from tests.planner.drawn_maps import PARAMS, costmap_of, drawn_map

AHEAD = Velocity2d(0.5, 0.0)
HERE = Pose2d(1.0, 2.0, math.pi / 2)
START = ProgressMonitor(HERE, 0.0)


def updated(
    progress: ProgressMonitor,
    now_s: float,
    pose: Pose2d = HERE,
    command: Velocity2d = AHEAD,
    collided: bool = False,
) -> ProgressMonitor:
    sample = MotionSample(pose, command, collided, now_s)
    return progress.update(sample, PARAMS.recovery)


def test_commanded_without_moving_it_backs_up() -> None:
    assert updated(START, 2.9).backing_from is None
    assert updated(START, 3.1).backing_from == HERE


OPEN = drawn_map(*["." * 40] * 20)
BESIDE = drawn_map(*["." * 40] * 7, "." * 18 + "####" + "." * 18, *["." * 40] * 12)


@pytest.mark.parametrize(
    ("shown", "command", "before", "met_xy"),
    [
        (OPEN, AHEAD, [], (1.0, 2.25)),
        (OPEN, Velocity2d(0.0, 0.0, -0.3), [], (1.25, 2.0)),
        (OPEN, Velocity2d(-0.1, 0.0), [], (1.0, 1.75)),
        (BESIDE, AHEAD, [], (0.754, 2.05)),  # to the left, a cell farther than its edge
        (BESIDE, AHEAD, [(1.0, 2.25)], (0.754, 2.05)),
        (BESIDE, AHEAD, [(0.75, 2.1)], (1.0, 2.25)),  # from there it kept away
        (BESIDE, Velocity2d(0.0, 0.0, -0.3), [], (1.25, 2.0)),  # it was left behind
    ],
)
def test_a_robot_met_the_obstacle_that_the_map_shows_on_its_side_or_what_is_ahead(
    shown: MapView,
    command: Velocity2d,
    before: list[tuple[float, float]],
    met_xy: tuple[float, float],
) -> None:
    costmap, before_xy = costmap_of(shown, HERE.xy, PARAMS.costmap), np.reshape(before, (-1, 2))
    assert met_at(HERE, command, costmap, before_xy) == pytest.approx(met_xy, abs=0.01)


def test_a_collision_counts_at_once_but_only_when_driving_at_it() -> None:
    assert updated(START, 0.1, collided=True).stuck_count == 1
    assert updated(START, 0.1, collided=True, command=STOP).stuck_count == 0


def test_what_the_map_shows_in_the_way_gives_up_goals_but_no_search() -> None:
    monitor, counts = START, []
    for k in range(8):
        at_s = 10.0 * (k + 1)
        stuck = MotionSample(HERE, AHEAD, False, at_s, blocked=True)
        monitor = monitor.update(stuck, PARAMS.recovery)
        counts.append(monitor.stuck_count)
        done = MotionSample(HERE, AHEAD, False, at_s + BACK_UP_S)
        monitor = monitor.update(done, PARAMS.recovery)
    assert counts == [1, 2, 3, 1, 2, 3, 1, 2]


def test_backing_ends_by_way_or_by_time() -> None:
    stuck = updated(START, 3.1)
    assert updated(stuck, 3.5).backing_from == HERE
    assert updated(stuck, 3.5, Pose2d(1.0, 1.7, math.pi / 2)).backing_from is None
    assert updated(stuck, 3.2 + BACK_UP_S).backing_from is None


def test_getting_stuck_is_counted_per_place() -> None:
    progress = updated(START, 0.1, collided=True)
    progress = updated(progress, 9.0)
    again = updated(progress, 9.1, collided=True)
    assert again.stuck_count == 2
    elsewhere = updated(progress, 9.1, Pose2d(5.0, 2.0, 0.0), collided=True)
    assert elsewhere.stuck_count == 1
