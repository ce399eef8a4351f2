"""A robot that does not get on backs up and remembers what it ran into."""

import math

import pytest

from onemap_planner.motion.progress import Footing, blocks_xy, feel
from onemap_planner.motion.pure_pursuit import STILL, Pose, Velocity
from tests.planner.drawn_maps import RULES

AHEAD = Velocity(0.5, 0.0)
HERE = Pose(1.0, 2.0, math.pi / 2)
START = Footing(HERE, 0.0)


def felt(
    footing: Footing,
    now_s: float,
    pose: Pose = HERE,
    command: Velocity = AHEAD,
    collided: bool = False,
) -> Footing:
    return feel(
        footing, pose, command=command, collided=collided, now_s=now_s, rules=RULES.recovery
    )


def test_standing_still_on_purpose_is_no_trouble() -> None:
    assert felt(START, 60.0, command=STILL).backing_from is None


def test_moving_or_turning_is_no_trouble() -> None:
    assert felt(START, 60.0, Pose(1.5, 2.0, 0.0)).backing_from is None
    turning = felt(START, 60.0, Pose(1.0, 2.0, 0.5), Velocity(0.0, 1.0))
    assert turning.backing_from is None


def test_commanded_without_moving_it_backs_up_and_marks_the_place_ahead() -> None:
    assert felt(START, 2.9).backing_from is None
    stuck = felt(START, 3.1)
    assert stuck.backing_from == HERE
    assert blocks_xy(stuck).tolist() == [[pytest.approx(1.0), pytest.approx(2.25)]]


def test_a_collision_counts_at_once_but_only_when_driving_at_it() -> None:
    assert felt(START, 0.1, collided=True).bumps == 1
    assert felt(START, 0.1, collided=True, command=STILL).bumps == 0


def test_stuck_while_turning_marks_nothing() -> None:
    stuck = felt(START, 3.1, command=Velocity(0.0, 1.0))
    assert stuck.backing_from == HERE
    assert stuck.blocks == ()


def test_backing_ends_by_way_or_by_time() -> None:
    stuck = felt(START, 3.1)
    assert felt(stuck, 3.5).backing_from == HERE
    assert felt(stuck, 3.5, Pose(1.0, 1.7, math.pi / 2)).backing_from is None
    assert felt(stuck, 3.2 + RULES.recovery.back_up_s).backing_from is None


def test_bumps_in_one_place_add_up_and_elsewhere_begin_anew() -> None:
    footing = felt(START, 0.1, collided=True)
    footing = felt(footing, 9.0)
    again = felt(footing, 9.1, collided=True)
    assert again.bumps == 2
    elsewhere = felt(footing, 9.1, Pose(5.0, 2.0, 0.0), collided=True)
    assert elsewhere.bumps == 1


def test_blocks_are_forgotten_after_a_while() -> None:
    stuck = felt(START, 3.1)
    assert felt(stuck, 3.2 + RULES.recovery.block_s, command=STILL).blocks == ()
