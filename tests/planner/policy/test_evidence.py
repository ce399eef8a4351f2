"""Detections become candidates, except rejected ones and objects found before."""

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.policy.competition import FoundObject
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.evidence import update_candidates
from onemap_planner.policy.state import PlannerState, TargetState
from onemap_planner.world.map_view import WorldCells
from onemap_shared.messages import Detections
from tests.planner.drawn_maps import PARAMS
from tests.planner.one_room import SEARCH, context

SOFA: WorldCells = frozenset((x, y) for x in range(20, 24) for y in range(20, 24))


def similar_to_sofa(rival: float = -np.inf) -> PlanningContext:
    """The room with similarity 0.8 on the sofa's cells, and this rival similarity there."""
    plain = context()
    view = plain.map_view
    own, other = view.similarity.copy(), np.full_like(view.similarity, -np.inf)
    x, y = view.indices_of(SOFA).T
    own[x, y], other[x, y] = 0.8, rival
    return replace(plain, map_view=replace(view, similarity=own, margin=own - other))


def frame(name: str = "sofa") -> Detections:
    points = np.array([[(x + 0.5) / 10, (y + 0.5) / 10, 0.5] for x, y in sorted(SOFA)], np.float32)
    return Detections(
        sequence=1,
        stamp_ns=0,
        detector_id="test",
        names=(name,),
        boxes_px=np.zeros((1, 4), np.float32),
        scores=np.array([0.8], np.float32),
        points_map=points,
        point_owner=np.zeros(len(points), np.int32),
    )


def test_the_frames_of_a_step_are_merged() -> None:
    after = update_candidates(
        PlannerState(SEARCH), (frame(), frame()), similar_to_sofa(), PARAMS.consensus
    )
    (candidate,) = after.target_state.candidates
    assert candidate.sightings == 2
    assert candidate.cells == SOFA
    assert candidate.xyz == pytest.approx((2.2, 2.2, 0.5))


def test_another_name_there_is_counted() -> None:
    seen = similar_to_sofa()
    state = update_candidates(PlannerState(SEARCH), (frame(),), seen, PARAMS.consensus)
    after = update_candidates(state, (frame("bed"),), seen, PARAMS.consensus)
    (candidate,) = after.target_state.candidates
    assert (candidate.sightings, candidate.contradictions) == (1, 1)


def test_a_rejected_candidate_does_not_come_back() -> None:
    seen = similar_to_sofa()
    state = update_candidates(PlannerState(SEARCH), (frame(),), seen, PARAMS.consensus)
    rejected = TargetState(rejected=state.target_state.candidates)
    after = update_candidates(
        replace(state, target_state=rejected), (frame(),), seen, PARAMS.consensus
    )
    assert after.target_state.candidates == ()


@pytest.mark.parametrize(("rival", "kept"), [(0.9, 0), (0.7, 1)])
def test_a_found_object_is_not_a_candidate_where_its_name_fits_better(
    rival: float, kept: int
) -> None:
    state = update_candidates(PlannerState(SEARCH), (frame(),), similar_to_sofa(), PARAMS.consensus)
    state = replace(state, found_objects=(FoundObject("bed", SOFA),))
    after = update_candidates(state, (), similar_to_sofa(rival), PARAMS.consensus)
    assert len(after.target_state.candidates) == kept
