"""Walking up to a candidate: where to stand, when to believe it, when to leave it."""

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.motion.motions import Pose2d, Rest
from onemap_planner.policy.context import PlanningContext, build_context
from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility
from onemap_planner.policy.state import (
    MAX_LOOKS,
    Observation,
    PlannerState,
    TargetState,
    blacklist,
    is_blacklisted,
    latest_candidate,
    reconsider,
    reject_candidate,
)
from onemap_planner.policy.step import step
from onemap_planner.policy.verify import approach, confirm
from onemap_planner.policy.viewpoints import _occupied_only, find_viewpoint
from onemap_planner.search.events import Confirmed, EventStamp, Rejected
from onemap_planner.search.phases import Approaching, Confirming, Exploring, Finished
from onemap_planner.search.state_machine import new_search
from onemap_planner.world.candidates import ObjectCandidate
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import SearchState
from tests.planner.drawn_maps import NO_POINTS, PARAMS, drawn_map, search_view_of

ROOM = search_view_of(drawn_map(*["#" * 8, *["#......#"] * 6, "#" * 8], scale=5))
POSE = Pose2d(1.0, 1.0, 0.0)
SEARCH = new_search("id", ("sofa",), EventStamp(0.0, 0.0, (1.0, 1.0), 0.0), 0)


def candidate(x: float, y: float, sightings: int = 3) -> ObjectCandidate:
    cell = (int(x / 0.1), int(y / 0.1))
    return ObjectCandidate((x, y, 0.5), frozenset({cell}), sightings, 0.9, 0.8, ((1.0, 1.0),))


def planner_state(*candidates: ObjectCandidate, active_time_s: float = 0.0) -> PlannerState:
    return PlannerState(SEARCH, TargetState(candidates=candidates), active_time_s=active_time_s)


def context() -> PlanningContext:
    return build_context(POSE, ROOM, trail=(), obstacles_xy=NO_POINTS, params=PARAMS.costmap)


def test_it_stands_within_reach_of_the_surface() -> None:
    viewpoint = find_viewpoint(candidate(2.5, 2.5), context(), PARAMS.explore.bands_m)
    assert viewpoint is not None
    away = np.hypot(viewpoint[0] - 2.55, viewpoint[1] - 2.55)
    assert PARAMS.explore.approach_nearest_m <= away <= PARAMS.explore.approach_farthest_m


def test_what_stands_deep_on_furniture_is_approached_as_near_as_possible() -> None:
    viewpoint = find_viewpoint(
        candidate(2.0, 3.9), context(), PARAMS.explore.bands_m
    )  # beyond the wall's face
    assert viewpoint is not None
    assert np.hypot(viewpoint[0] - 2.0, viewpoint[1] - 3.9) < PARAMS.explore.approach_last_resort_m


def test_a_stray_cell_before_the_thing_does_not_keep_the_robot_away() -> None:
    thing = frozenset((x, y) for x in (24, 25) for y in (24, 25))
    stray = thing | {(17, 19)}  # towards the robot
    seen = replace(candidate(2.5, 2.5), cells=stray, recent=(stray, *[thing] * 8))
    viewpoint = find_viewpoint(seen, context(), PARAMS.explore.bands_m)
    assert viewpoint is not None
    assert np.hypot(viewpoint[0] - 2.45, viewpoint[1] - 2.45) < 1.5


def test_nowhere_to_stand_is_waited_for_and_then_rejected() -> None:
    far = candidate(9.0, 9.0)
    assert find_viewpoint(far, context(), PARAMS.explore.bands_m) is None
    after, motion, event = approach(planner_state(far), Approaching(far), context(), PARAMS)
    assert (motion, event) == (Rest(), None)
    later = replace(after, active_time_s=PARAMS.explore.settle_s + 0.1)
    after, _, event = approach(later, Approaching(far), context(), PARAMS)
    assert event == Rejected()
    assert after.target_state.candidates == ()
    assert after.target_state.rejected == (far,)


def test_the_candidate_is_followed_when_sightings_move_it() -> None:
    old = candidate(2.0, 2.0)
    moved = replace(candidate(2.3, 2.0, 5), cells=frozenset({(1, 1)}))
    shares = replace(candidate(4.0, 4.0), cells=old.cells)
    assert latest_candidate(planner_state(moved), old, PARAMS.consensus) == moved
    assert latest_candidate(planner_state(moved, shares), old, PARAMS.consensus) == shares
    assert latest_candidate(planner_state(candidate(4.0, 4.0)), old, PARAMS.consensus) == old


@pytest.mark.parametrize(("more", "sure"), [(5, False), (6, True)])
def test_enough_new_detections_confirm(more: int, sure: bool) -> None:
    then = candidate(2.0, 2.0, 4)
    now = replace(then, sightings=4 + more)
    _, _, event = confirm(planner_state(now), Confirming(then, 0.0), context(), PARAMS)
    assert event == (Confirmed(now) if sure else None)


def test_without_them_it_is_rejected_after_a_while() -> None:
    then = candidate(2.0, 2.0)
    waited = planner_state(then, active_time_s=PARAMS.explore.confirm_s + 0.1)
    after, _, event = confirm(waited, Confirming(then, 0.0), context(), PARAMS)
    assert event == Rejected()
    assert after.target_state.rejected == (then,)


def stuck_state(phase: Approaching | Exploring, stuck_count: int) -> PlannerState:
    """The mind after this many collisions in one place, five seconds apart."""
    state = replace(planner_state(candidate(2.5, 2.5)), search=replace(SEARCH, phase=phase))
    for number in range(8 * stuck_count + 5):
        observation = Observation(
            now_s=0.7 * number,
            pose=POSE,
            odometer_m=0.0,
            command=Velocity2d(0.3, 0.0),
            collided=number % 8 == 7,
            view=ROOM,
            detections=(),
            stale_reason="",
        )
        state, _ = step(state, observation, PARAMS)
    return state


def test_bumps_give_up_the_candidate_and_a_robot_that_is_held_gives_up() -> None:
    target = candidate(2.5, 2.5)
    left = stuck_state(Approaching(target), PARAMS.recovery.max_stuck_count)
    assert left.target_state.rejected == (target,) or left.target_state.reconsidered
    end = stuck_state(Approaching(target), PARAMS.recovery.max_stuck_count + 2).search
    assert end.phase == Finished(SearchState.FAILED)
    assert end.reason == "the robot is stuck at (1.0, 1.0)"


def goal(kind: GoalKind) -> Goal:
    return Goal(kind, (0.0, 0.0), (1.0, 1.0), GoalUtility(0.5, 0.0, 1.0, 0.0), "")


@pytest.mark.parametrize(
    ("kind", "looks"),
    [(GoalKind.FRONTIER, 1), (GoalKind.REGION, MAX_LOOKS), (GoalKind.DETECTION, MAX_LOOKS)],
)
def test_goals_that_come_to_nothing_are_left_alone(kind: GoalKind, looks: int) -> None:
    state = planner_state()
    for _ in range(looks):
        assert not is_blacklisted(state, goal(kind), 0.5)
        state = blacklist(state, goal(kind))
    assert is_blacklisted(state, goal(kind), 0.5)


def test_what_was_rejected_gets_one_more_chance() -> None:
    state = reject_candidate(planner_state(candidate(2.5, 2.5)), candidate(2.5, 2.5))
    again = reconsider(state)
    assert again.target_state.rejected == ()
    assert again.target_state.reconsidered


def test_floor_before_a_thing_is_not_taken_for_its_surface() -> None:
    """A detection's rim lies on the floor; the stand keeps its distance from what stands there."""
    here = context()
    solid = np.argwhere(here.costmap.occupied)
    free = np.argwhere(~here.costmap.occupied)
    both = np.concatenate([free[:3], solid[:2]])
    np.testing.assert_array_equal(_occupied_only(both, here.costmap), solid[:2])
    np.testing.assert_array_equal(_occupied_only(free[:3], here.costmap), free[:3])
