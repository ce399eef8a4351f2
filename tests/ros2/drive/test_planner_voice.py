from __future__ import annotations

import pytest

from onemap_ros2.drive.driver import MAX_COMMAND_AGE_S, MAX_PLAN_AGE_S, GoalPose, PlannerVoice
from onemap_shared.messages import SearchState
from tests.ros2.planner_messages import path_to, status

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


def test_the_plan_of_the_search_before_counts_for_nothing() -> None:
    following = VOICE.with_status(status("s2"))
    assert following.goal(10.1, ROBOT) is None
    assert VOICE.with_status(status("s1")) == VOICE
