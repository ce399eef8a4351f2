"""What counts as having come where the robot's own navigation ends its goals early."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.motion.motions import Drive, Pose2d
from onemap_planner.policy.arrival import IN_VIEW_RAD, ArrivalState, arrive, stands_at
from onemap_planner.policy.goals import GoalKind
from onemap_planner.policy.move import explore
from onemap_shared.geometry import wrap_angle
from tests.planner.drawn_maps import drawn_map, search_view_of
from tests.planner.one_room import context_of, planner_state, standing

WALLED = drawn_map(*["." * 12] * 5, "....########", "." * 12, *["." * 12] * 5, scale=2)


@pytest.mark.parametrize(
    ("pose", "reached", "expected"),
    [
        (Pose2d(2.2, 0.6, 0.0), None, ArrivalState.ON_WAY),
        (Pose2d(2.2, 0.6, 0.0), Pose2d(2.0, 1.5, 0.0), ArrivalState.ON_WAY),  # of another goal
        (Pose2d(2.1, 0.6, -math.pi / 2 + 0.2), Pose2d(2.0, 0.6, -1.5), ArrivalState.THERE),
        (Pose2d(2.2, 0.7, 0.0), Pose2d(2.0, 0.6, 0.0), ArrivalState.ON_WAY),  # it has yet to turn
        (
            Pose2d(2.2, 0.7, 0.0),
            Pose2d(2.2, 0.7, -2.0),
            ArrivalState.NO_VIEW,
        ),  # it did not turn
    ],
)
def test_near_enough_to_look_from(
    pose: Pose2d, reached: Pose2d | None, expected: ArrivalState
) -> None:
    here = replace(standing(WALLED, pose.xy), pose=pose, reached=reached)
    motion = Drive(np.array([pose.xy, (2.0, 0.6)]), (2.0, 0.1))
    assert arrive(motion, here)[0] is expected
    assert stands_at((2.0, 0.6), here) == (reached is not None and reached.y_m < 1.0)


def test_a_turn_in_place_faces_it_from_where_the_robot_stands() -> None:
    pose = Pose2d(2.0, 1.85, 0.0)
    here = replace(standing(WALLED, pose.xy), pose=pose, reached=Pose2d(2.0, 1.6, 0.0))
    at, turn = arrive(Drive(np.array([pose.xy, (2.0, 1.6)]), (2.0, 0.6)), here)
    assert at is ArrivalState.ON_WAY
    assert turn.points_xy.tolist() == [[2.0, 1.85]]
    assert pose.bearing_to(turn.look_xy) == pytest.approx(-math.pi / 2)
    # Too near for a direction the heading counts that the goal had.
    close = Drive(np.array([pose.xy, (2.0, 1.6)]), (2.2, 1.6))
    assert arrive(close, here)[0] is ArrivalState.THERE


def test_what_a_wall_hides_from_where_the_robot_stands_is_no_view() -> None:
    look_xy, end_xy = (0.6, 1.6), (0.9, 1.6)
    for pose, reached_x_m, expected in (
        (Pose2d(0.85, 1.8, math.pi), 0.9, ArrivalState.THERE),
        (Pose2d(1.3, 1.6, math.pi), 1.1, ArrivalState.ON_WAY),  # it was not asked to go right there
        (Pose2d(1.3, 1.6, math.pi), 0.9, ArrivalState.NO_VIEW),  # it stopped before the wall
    ):
        reached = Pose2d(reached_x_m, 1.6, math.pi)
        here = replace(standing(WALLED, pose.xy), pose=pose, reached=reached)
        assert arrive(Drive(np.array([pose.xy, end_xy]), look_xy), here)[0] is expected


def test_a_goal_without_the_view_is_left_for_another() -> None:
    """And the next one is no repetition of it."""
    halls = search_view_of(drawn_map(*["." * 8 + " " * 4] * 12, scale=4))
    here = context_of(halls, Pose2d(2.0, 1.0, 0.0))
    state = planner_state()
    explore(state, here)
    assert state.active_goal is not None
    goal = state.active_goal.goal
    assert goal.kind is GoalKind.FRONTIER
    x_m, y_m = goal.viewpoint_xy
    yaw_rad = math.atan2(goal.look_xy[1] - y_m, goal.look_xy[0] - x_m)
    wrong = Pose2d(x_m - 0.2, y_m, wrap_angle(yaw_rad + 2 * IN_VIEW_RAD))
    asked = Pose2d(x_m, y_m, yaw_rad)
    after = state.copy()
    move = explore(after, replace(context_of(halls, wrong), reached=asked))
    assert (move.event, after.active_goal) == (None, None)
    (tried,) = after.ledger.attempts
    assert tried.xy == goal.look_xy
