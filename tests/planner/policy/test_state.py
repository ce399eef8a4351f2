"""Goals are blacklisted, candidates followed, rejected and reconsidered."""

from dataclasses import replace

import pytest

from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility
from onemap_planner.policy.state import (
    MAX_LOOKS,
    blacklist,
    is_blacklisted,
    latest_candidate,
    reconsider,
    reject_candidate,
)
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
    return Goal(kind, (0.0, 0.0), (1.0, 1.0), GoalUtility(0.5, 0.0, 1.0, 0.0), "")


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
