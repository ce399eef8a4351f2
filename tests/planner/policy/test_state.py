"""Goals are blacklisted, candidates followed, rejected and reconsidered."""

from dataclasses import replace

import pytest

from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility
from onemap_planner.policy.state import (
    MAX_LOOKS,
    ActiveGoal,
    Observation,
    TargetState,
    blacklist,
    is_blacklisted,
    latest_candidate,
    reconsider,
    reject_candidate,
)
from onemap_planner.policy.step import step
from onemap_shared.geometry import Velocity2d
from tests.planner.drawn_maps import PARAMS
from tests.planner.one_room import candidate, planner_state


def test_the_candidate_is_followed_when_sightings_move_it() -> None:
    old = candidate(2.0, 2.0)
    moved = replace(candidate(2.3, 2.0, 5), cells=frozenset({(1, 1)}))
    shares = replace(candidate(4.0, 4.0), cells=old.cells)
    assert latest_candidate(planner_state(moved), old, PARAMS.consensus) == moved
    assert latest_candidate(planner_state(moved, shares), old, PARAMS.consensus) == shares
    assert latest_candidate(planner_state(candidate(4.0, 4.0)), old, PARAMS.consensus) == old


def goal(kind: GoalKind) -> Goal:
    return Goal(kind, (0.0, 0.0), (1.0, 1.0), GoalUtility(0.5, 0.0, 1.0, 1.0), "")


@pytest.mark.parametrize(
    ("kind", "looks"),
    [(GoalKind.FRONTIER, 1), (GoalKind.REGION, MAX_LOOKS), (GoalKind.DETECTION, MAX_LOOKS)],
)
def test_goals_are_blacklisted_after_enough_visits(kind: GoalKind, looks: int) -> None:
    state = planner_state()
    for _ in range(looks):
        assert not is_blacklisted(state, goal(kind), 0.5)
        state = blacklist(state, goal(kind))
    assert is_blacklisted(state, goal(kind), 0.5)


def test_rejected_candidates_are_reconsidered_once() -> None:
    state = reject_candidate(planner_state(candidate(2.5, 2.5)), candidate(2.5, 2.5))
    again = reconsider(state, frontiers=False)
    assert again.target_state.rejected == ()
    assert again.target_state.reconsidered


@pytest.mark.parametrize("frontiers", [True, False])
def test_blacklisted_frontiers_are_reconsidered_on_request(frontiers: bool) -> None:
    state = replace(planner_state(), blacklisted_frontiers=((1.0, 2.0),))
    again = reconsider(state, frontiers=frontiers)
    assert again.blacklisted_frontiers == (() if frontiers else ((1.0, 2.0),))


def test_frontiers_that_were_given_up_on_the_way_are_offered_again() -> None:
    frontier = goal(GoalKind.FRONTIER)
    elsewhere = replace(frontier, look_xy=(5.0, 5.0))
    state = blacklist(blacklist(planner_state(), frontier, reached=False), elsewhere)
    assert is_blacklisted(state, frontier, 0.5)
    again = reconsider(state, frontiers=False)
    assert not is_blacklisted(again, frontier, 0.5)
    assert is_blacklisted(again, elsewhere, 0.5)
    assert again.unreached_frontiers == ()


def test_creeping_takes_as_much_of_a_goal_s_time_as_its_way_at_full_speed() -> None:
    frontier = goal(GoalKind.FRONTIER)
    active = TargetState(active_goal=ActiveGoal(frontier, 2.0, 9.0, frontier.look_xy))
    state = replace(planner_state(), target_state=active, active_time_s=5.0, last_step_s=0.0)
    spent = {}
    for creeps in (False, True):
        seen = Observation(1.0, None, 0.0, Velocity2d(), False, None, (), "", creeps=creeps)
        after, _ = step(state, seen, PARAMS)
        goal_now = after.target_state.active_goal
        assert goal_now is not None
        spent[creeps] = after.active_time_s - goal_now.since_s - 3.0
    assert spent[False] == pytest.approx(1.0)
    assert spent[True] == pytest.approx(PARAMS.drive.unseen_mps / PARAMS.drive.max_linear_mps)
