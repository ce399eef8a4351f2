from __future__ import annotations

import math
import struct

import pytest

from onemap_ros2.drive.driver import (
    MAX_COMMAND_AGE_S,
    MAX_PLAN_AGE_S,
    GoalPose,
    PlannerVoice,
    encoded_pose,
    end_of,
    goal_of,
    pose_of,
)
from onemap_shared.geometry import pose_2d
from onemap_shared.messages import SearchState
from tests.ros2.planner_messages import path_to, status

ROBOT = GoalPose(0.0, 0.0, 0.5)


def assert_near(goal: GoalPose | None, x_m: float, y_m: float, yaw_rad: float) -> None:
    assert goal is not None
    assert (goal.x_m, goal.y_m, goal.yaw_rad) == pytest.approx((x_m, y_m, yaw_rad))


def test_the_goal_is_the_end_of_the_path_and_faces_what_is_looked_at() -> None:
    goal = goal_of(path_to(2.0, 0.0, look=(2.0, 5.0)), ROBOT)
    assert_near(goal, 2.0, 0.0, math.pi / 2)


def test_to_rotate_is_a_quarter_turn_to_the_left_in_place() -> None:
    goal = goal_of(path_to(3.0, 0.0, "rotate"), GoalPose(1.0, 2.0, 3.0))
    assert_near(goal, 1.0, 2.0, 3.0 - 1.5 * math.pi)


@pytest.mark.parametrize("motion", ["rest", "reverse", ""])
def test_other_motions_are_no_goal(motion: str) -> None:
    assert goal_of(path_to(3.0, 0.0, motion), ROBOT) is None
    assert end_of(path_to(3.0, 0.0, motion)) is None


def test_goals_differ_by_distance_or_heading() -> None:
    goal = GoalPose(1.0, 1.0, 3.1)
    assert not goal.differs(GoalPose(1.3, 1.0, -2.7))
    assert goal.differs(GoalPose(1.5, 1.0, 3.1))
    assert goal.differs(GoalPose(1.0, 1.0, 2.4))


def test_a_pose_has_the_bytes_that_struct_builds() -> None:
    goal = pose_of(pose_2d(1.5, -2.0, math.pi / 3))
    body = struct.pack("<iII4s", 3, 7, 4, b"map\0")
    golden = struct.pack("<7d", 1.5, -2.0, 0, 0, 0, math.sin(math.pi / 6), math.cos(math.pi / 6))
    encoded = encoded_pose(goal, 3_000_000_007, "map")
    assert encoded[:20] == bytes((0, 1, 0, 0)) + body
    assert struct.unpack("<7d", encoded[20:]) == pytest.approx(struct.unpack("<7d", golden))


ROBOT = GoalPose(0.0, 0.0, 0.0)
VOICE = (
    PlannerVoice().with_status(status("s1")).with_path(path_to(2.0, 0.0), 10.0).with_command(10.0)
)


def test_a_search_with_a_recent_plan_and_a_recent_command_has_a_goal() -> None:
    assert VOICE.goal(10.1, ROBOT) == GoalPose(2.0, 0.0, 0.0)


@pytest.mark.parametrize("missing", ["search", "plan", "command"])
def test_without_one_of_them_there_is_no_goal(missing: str) -> None:
    voice = PlannerVoice()
    if missing != "search":
        voice = voice.with_status(status("s1"))
    if missing != "plan":
        voice = voice.with_path(path_to(2.0, 0.0), 10.0)
    if missing != "command":
        voice = voice.with_command(10.0)
    assert voice.goal(10.1, ROBOT) is None


def test_a_goal_ends_when_the_plan_or_the_planner_falls_silent() -> None:
    late_s = 10.0 + MAX_PLAN_AGE_S + 0.01
    assert VOICE.goal(10.0 + MAX_COMMAND_AGE_S + 0.01, ROBOT) is None
    assert VOICE.with_command(late_s).goal(late_s, ROBOT) is None


@pytest.mark.parametrize("state", [SearchState.CANCELLED, SearchState.FOUND, SearchState.FAILED])
def test_the_end_of_a_search_ends_its_goal(state: SearchState) -> None:
    assert VOICE.with_status(status("s1", state)).goal(10.1, ROBOT) is None
