"""Candidates are approached, then confirmed or rejected by new detections."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.motion.motions import Drive, Pose2d, Rest
from onemap_planner.policy.choose import select_candidate
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.ledger import MAX_LOOKS
from onemap_planner.policy.state import SETTLE_S, Evidence, PlannerState
from onemap_planner.policy.verify import CONFIRM_S, approach, confirm
from onemap_planner.policy.viewpoints import find_viewpoint
from onemap_planner.search import state_machine as sm
from onemap_planner.world.candidates import (
    VIEWS_PER_VIEWPOINT,
    ObjectCandidate,
    Sighting,
    ViewpointTally,
)
from onemap_shared.messages import Detail
from tests.planner.drawn_maps import drawn_map, search_view_of
from tests.planner.one_room import POSE, candidate, context, context_of, decided, planner_state


def given_up(state: PlannerState, there: ObjectCandidate, here: PlanningContext) -> PlannerState:
    """The state after waiting for a way to the candidate for as long as it is waited for."""
    began_s = state.active_time_s
    state, motion, event = decided(approach, state, sm.Approaching(there), here)
    assert (motion, event) == (Rest(), None)
    state = replace(state, active_time_s=began_s + SETTLE_S + 0.1)
    state, _, event = decided(approach, state, sm.Approaching(there), here)
    assert event == sm.Rejected()
    return state


def in_next_room(door: str) -> PlanningContext:
    """Two rooms of 2 x 1.5 m, the robot in one of them; door: "." open, "#" closed."""
    rows = ["#" * 9, "#...#...#", f"#...{door}...#", f"#...{door}...#", "#...#...#", "#" * 9]
    view = search_view_of(drawn_map(*rows, scale=5))
    return context_of(view)


def test_a_candidate_to_which_no_way_leads_is_kept_until_there_is_one() -> None:
    far, opened, closed = candidate(1.2, 3.2), in_next_room("."), in_next_room("#")
    state = planner_state(far)
    state = given_up(state, far, closed)
    assert state.evidence.rejected == ()
    assert select_candidate(state, closed) is None
    assert select_candidate(state, opened) == sm.CandidateSelected(far)


@pytest.mark.parametrize(("more", "sure"), [(5, False), (6, True)])
def test_enough_new_detections_confirm(more: int, sure: bool) -> None:
    then = candidate(1.7, 1.7, 4)
    now = replace(then, sightings=4 + more)
    _, _, event = decided(confirm, planner_state(now), sm.Confirming(then, 0.0), context())
    assert event == (sm.Confirmed(now) if sure else None)


def test_nothing_is_found_whose_description_cannot_be_checked() -> None:
    then = candidate(1.7, 1.7, 4)
    state = planner_state(replace(then, sightings=10))
    state = replace(state, search=replace(state.search, details=(Detail(colour="red"),)))
    _, _, event = decided(confirm, state, sm.Confirming(then, 0.0), context())
    assert event is None


def test_a_part_of_it_that_is_not_as_described_rules_it_not_out() -> None:
    whole = candidate(2.5, 2.5, 9)
    part = replace(whole, sightings=4)
    state = planner_state(whole)
    state = replace(state, evidence=replace(state.evidence, mismatched=(part,)))
    _, motion, event = decided(approach, state, sm.Approaching(whole), context())
    assert isinstance(motion, Drive)
    assert event is None
    state = replace(state, evidence=Evidence(mismatched=(part,)))
    assert decided(approach, state, sm.Approaching(part), context())[2] == sm.Rejected()


LATE_S = CONFIRM_S + 0.1


def test_without_them_it_is_looked_at_from_other_sides_and_then_rejected() -> None:
    then = candidate(1.7, 1.7)
    state, looks = planner_state(then, active_time_s=LATE_S), 0
    here = context()
    while True:
        looks += 1
        state, _, event = decided(confirm, state, sm.Confirming(then, 0.0), here)
        if event == sm.Rejected():
            break
        assert event == sm.CandidateSelected(then)
        tried = state.ledger.looked_from(then.xyz[:2])
        assert len(tried) == looks
        viewpoint_xy = find_viewpoint(then, here, tried)
        assert viewpoint_xy is not None
        assert min(np.hypot(*np.subtract(viewpoint_xy, xy)) for xy in tried) > 0.5
        here = replace(here, pose=Pose2d(*viewpoint_xy, 0.0))
    assert looks == MAX_LOOKS
    assert state.evidence.rejected == (then,)


@pytest.mark.parametrize(("contradictions", "sure"), [(5, True), (6, False)])
def test_it_is_not_confirmed_while_another_name_is_detected_as_often(
    contradictions: int, sure: bool
) -> None:
    then = candidate(1.7, 1.7, 4)
    now = replace(then, sightings=10, contradictions=contradictions)
    state = planner_state(now)
    _, _, event = decided(confirm, state, sm.Confirming(then, 0.0), context())
    assert event == (sm.Confirmed(now) if sure else None)


ENOUGH = VIEWS_PER_VIEWPOINT
BEFORE = sm.Confirming(replace(candidate(1.7, 1.7), supported=False), 0.0)


def disputed(*hits: int, frames: int = ENOUGH) -> ObjectCandidate:
    """A candidate that the map does not support, with these hits from the pose and elsewhere."""
    tallies = tuple(
        ViewpointTally((POSE.x_m + 5.0 * place, POSE.y_m), count, frames)
        for place, count in enumerate(hits)
    )
    return replace(candidate(1.7, 1.7, 10), supported=False, near_views=tallies)


def ranked(rank: float) -> PlanningContext:
    """The room, with this rank on the map everywhere."""
    plain = context()
    guidance = np.full_like(plain.map_view.guidance, rank)
    return replace(plain, map_view=replace(plain.map_view, guidance=guidance))


def weighed(
    known: ObjectCandidate, *, rank: float = 0.95, waited_s: float = 0.0
) -> tuple[PlannerState, sm.Event | None]:
    state = replace(planner_state(active_time_s=waited_s), evidence=Evidence(unsupported=(known,)))
    after, _, event = decided(confirm, state, BEFORE, ranked(rank))
    return after, event


def test_many_near_views_from_two_sides_outweigh_the_map() -> None:
    known = disputed(24, 24)
    assert weighed(known)[1] == sm.Confirmed(known)
    after, event = weighed(known, rank=0.6)  # it says that it is something else
    assert event == sm.Rejected()
    assert after.evidence.unsupported == ()


def test_what_is_detected_in_few_of_the_near_views_is_rejected() -> None:
    known = disputed(6)
    after, event = weighed(known)
    assert event == sm.Rejected()
    assert after.evidence.rejected == (known,)


def test_undecided_it_is_looked_at_for_a_while_and_then_from_another_side() -> None:
    known = disputed(20)
    assert weighed(known)[1] is None
    late_s = CONFIRM_S + 0.1
    assert weighed(known, waited_s=late_s)[1] == sm.CandidateSelected(known)
    state = replace(planner_state(), evidence=Evidence(unsupported=(known,)))
    _, motion, _ = decided(approach, state, sm.Approaching(known), ranked(0.95))
    assert isinstance(motion, Drive)
    assert np.hypot(*(motion.points_xy[-1] - POSE.xy)) > 0.5


def test_an_object_that_proves_to_be_farther_away_is_approached_again() -> None:
    then = candidate(2.0, 1.0, 4)
    farther = replace(candidate(3.2, 1.0, 10), cells=frozenset({(20, 10), (32, 10)}))
    edge = Sighting((3.2, 1.0, 0.5), frozenset({(32, 10)}), 0.9, 0.8, (2.2, 1.0))
    farther = replace(farther, recent=(edge,) * 6)
    _, _, event = decided(confirm, planner_state(farther), sm.Confirming(then, 0.0), context())
    assert event == sm.CandidateSelected(farther)
    near = replace(context(), pose=Pose2d(2.2, 1.0, 0.0))
    _, _, event = decided(confirm, planner_state(farther), sm.Confirming(then, 0.0), near)
    assert event == sm.Confirmed(farther)


def test_where_it_was_not_confirmed_before_the_robot_does_not_go_again() -> None:
    """From here it is sure: it would drive to and fro between the two places for ever."""
    then, now = candidate(2.5, 1.0, 4), candidate(2.5, 1.0, 10)
    nearer_xy = find_viewpoint(now, context())
    assert nearer_xy is not None
    state = planner_state(now)
    _, _, event = decided(confirm, state, sm.Confirming(then, 0.0), context())
    assert event == sm.CandidateSelected(now)
    while nearer_xy is not None:
        state.ledger.looked_in_vain(now, nearer_xy)
        nearer_xy = find_viewpoint(now, context(), state.ledger.looked_from(now.xyz[:2]))
    _, _, event = decided(confirm, state, sm.Confirming(then, 0.0), context())
    assert event == sm.Confirmed(now)
