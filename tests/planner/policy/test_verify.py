"""Candidates are approached, then confirmed or rejected by new detections."""

from __future__ import annotations

from dataclasses import replace

import pytest

from onemap_planner.motion.motions import Rest
from onemap_planner.policy.verify import approach, confirm
from onemap_planner.policy.viewpoints import find_viewpoint
from onemap_planner.search.events import Confirmed, Rejected
from onemap_planner.search.phases import Approaching, Confirming
from tests.planner.drawn_maps import PARAMS
from tests.planner.one_room import candidate, context, planner_state


def test_a_candidate_without_viewpoint_is_rejected_after_a_while() -> None:
    far = candidate(9.0, 9.0)
    assert find_viewpoint(far, context(), PARAMS.explore.bands_m) is None
    after, motion, event = approach(planner_state(far), Approaching(far), context(), PARAMS)
    assert (motion, event) == (Rest(), None)
    later = replace(after, active_time_s=PARAMS.explore.settle_s + 0.1)
    after, _, event = approach(later, Approaching(far), context(), PARAMS)
    assert event == Rejected()
    assert after.target_state.candidates == ()
    assert after.target_state.rejected == (far,)


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


@pytest.mark.parametrize(("contradictions", "sure"), [(5, True), (6, False)])
def test_it_is_not_confirmed_while_another_name_is_detected_as_often(
    contradictions: int, sure: bool
) -> None:
    then = candidate(2.0, 2.0, 4)
    now = replace(then, sightings=10, contradictions=contradictions)
    state = planner_state(now)
    _, _, event = confirm(state, Confirming(then, 0.0), context(), PARAMS)
    assert event == (Confirmed(now) if sure else None)
