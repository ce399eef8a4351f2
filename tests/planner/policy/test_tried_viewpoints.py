"""A candidate is looked at from elsewhere each time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility
from onemap_planner.policy.state import Doubt, PlannerState, blacklist
from onemap_planner.policy.tried_viewpoints import next_viewpoint
from onemap_planner.policy.viewpoints import TRIED_M
from onemap_planner.world.candidates import SAME_SIDE_M, ObjectCandidate, ViewpointTally
from tests.planner.drawn_maps import PARAMS
from tests.planner.one_room import candidate, context, planner_state

THERE = candidate(2.5, 2.5)


def looked(xy: tuple[float, float], at: tuple[float, float], kind: GoalKind) -> Goal:
    return Goal(kind, xy, at, GoalUtility(0.9, 0.0, 1.0, 1.0), "")


def next_of(state: PlannerState, there: ObjectCandidate = THERE) -> tuple[float, float]:
    viewpoint = next_viewpoint(state, there, context(), PARAMS)
    assert viewpoint is not None
    return viewpoint


FIRST = next_of(planner_state())


def apart_m(viewpoint: tuple[float, float]) -> float:
    return float(np.hypot(viewpoint[0] - FIRST[0], viewpoint[1] - FIRST[1]))


def test_where_it_was_not_confirmed_from() -> None:
    target_state = replace(planner_state().target_state, doubts=(Doubt(FIRST, THERE.xyz),))
    assert apart_m(next_of(replace(planner_state(), target_state=target_state))) > TRIED_M


@pytest.mark.parametrize(
    ("kind", "at", "again"),
    [
        pytest.param(GoalKind.DETECTION, (2.5, 2.4), False, id="a look at it"),
        pytest.param(GoalKind.DETECTION, (0.9, 3.5), True, id="a look at something else"),
        pytest.param(GoalKind.REGION, (2.5, 2.4), True, id="a region is seen from farther away"),
    ],
)
def test_looks_before_it_was_detected_often(
    kind: GoalKind, at: tuple[float, float], again: bool
) -> None:
    viewpoint = next_of(blacklist(planner_state(), looked(FIRST, at, kind)))
    assert (viewpoint == FIRST) == again
    assert again or apart_m(viewpoint) > TRIED_M


def test_where_enough_was_seen_of_what_the_map_does_not_support() -> None:
    enough = PARAMS.acceptance.views_per_viewpoint
    tally = ViewpointTally(FIRST, hits=3, frames=enough)
    doubtful = replace(THERE, supported=False, near_views=(tally,))
    assert apart_m(next_of(planner_state(), doubtful)) > SAME_SIDE_M
    few = replace(doubtful, near_views=(replace(tally, frames=enough - 1),))
    assert next_of(planner_state(), few) == FIRST
