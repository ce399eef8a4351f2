"""Detections become candidates, except rejected ones and objects found before."""

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.progress import MAX_STUCK_COUNT, ProgressMonitor
from onemap_planner.policy.competition import FoundObject
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.evidence import update_candidates
from onemap_planner.policy.state import (
    MAX_LOOKS,
    Doubt,
    PlannerState,
    TargetState,
    reject_candidate,
)
from onemap_planner.policy.step import handle_stuck
from onemap_planner.search.phases import Approaching
from onemap_planner.world.map_view import WorldCells
from onemap_shared.messages import Detections, Occupancy
from tests.planner.one_room import POSE, SEARCH, context

SOFA: WorldCells = frozenset((x, y) for x in range(20, 24) for y in range(20, 24))


def similar_to_sofa(rival: float = -np.inf) -> PlanningContext:
    """The room with similarity 0.8 on the sofa's cells, and this rival similarity there."""
    plain = context()
    view = plain.map_view
    own, other = view.similarity.copy(), np.full_like(view.similarity, -np.inf)
    x, y = view.indices_of(SOFA).T
    own[x, y], other[x, y] = 0.8, rival
    return replace(plain, map_view=replace(view, similarity=own, margin=own - other))


def doubtful() -> PlanningContext:
    """The room with an obstacle on the sofa's cells that the map does not find similar."""
    plain = context()
    x, y = plain.map_view.indices_of(SOFA).T
    occupancy = plain.map_view.occupancy.copy()
    occupancy[x, y] = Occupancy.OCCUPIED
    here = Pose2d(1.2, 1.2, 0.78)  # 1.1 m away, looking at it
    return replace(plain, pose=here, map_view=replace(plain.map_view, occupancy=occupancy))


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
        independent=True,
    )


def test_the_frames_of_a_step_are_merged() -> None:
    after = update_candidates(
        PlannerState(SEARCH), (frame(), frame()), similar_to_sofa(), near_m=1.5
    )
    (candidate,) = after.target_state.candidates
    assert candidate.sightings == 2
    assert candidate.cells == SOFA
    assert candidate.xyz == pytest.approx((2.2, 2.2, 0.5))


def test_another_name_there_is_counted() -> None:
    seen = similar_to_sofa()
    state = update_candidates(PlannerState(SEARCH), (frame(),), seen, near_m=1.5)
    after = update_candidates(state, (frame("bed"),), seen, near_m=1.5)
    (candidate,) = after.target_state.candidates
    assert (candidate.sightings, candidate.contradictions) == (1, 1)


def test_a_rejected_candidate_does_not_come_back() -> None:
    seen = similar_to_sofa()
    state = update_candidates(PlannerState(SEARCH), (frame(),), seen, near_m=1.5)
    rejected = TargetState(rejected=state.target_state.candidates)
    after = update_candidates(replace(state, target_state=rejected), (frame(),), seen, near_m=1.5)
    assert after.target_state.candidates == ()


@pytest.mark.parametrize(
    ("looks", "back"),
    [(((1.0, 1.0),), False), (((3.4, 3.4),), True), (((3.4, 3.4),) * MAX_LOOKS, False)],
)
def test_a_rejected_candidate_comes_back_when_it_is_seen_from_another_side(
    looks: tuple[tuple[float, float], ...], back: bool
) -> None:
    seen = similar_to_sofa()
    state = update_candidates(PlannerState(SEARCH), (frame(),), seen, near_m=1.5)
    rejected = TargetState(
        rejected=state.target_state.candidates,
        doubts=tuple(Doubt(xy, (2.2, 2.2, 0.5)) for xy in looks),
    )
    state = replace(state, target_state=rejected)
    for _ in range(2):
        state = update_candidates(state, (frame(),), seen, near_m=1.5)
    sightings = [candidate.sightings for candidate in state.target_state.candidates]
    assert sightings == ([2] if back else [])


@pytest.mark.parametrize(("seen_from", "back"), [((1.5, 1.0), False), ((2.5, 1.0), True)])
def test_one_to_which_the_robot_got_stuck_comes_back_when_it_is_seen_from_elsewhere(
    seen_from: tuple[float, float], back: bool
) -> None:
    """Behind somebody who stands in a doorway, say: that tells nothing about the candidate."""
    seen = similar_to_sofa()
    state = update_candidates(PlannerState(SEARCH), (frame(),), seen, near_m=1.5)
    (sofa,) = state.target_state.candidates
    stuck = ProgressMonitor(POSE, 0.0, stuck_count=MAX_STUCK_COUNT, stuck_at=POSE)
    approaching = replace(SEARCH, phase=Approaching(sofa))
    state, _ = handle_stuck(replace(state, search=approaching, progress=stuck))
    assert state.target_state.candidates == ()
    seen = replace(seen, pose=Pose2d(*seen_from, 0.0))
    after = update_candidates(state, (frame(),), seen, near_m=1.5)
    assert bool(after.target_state.candidates) == back


@pytest.mark.parametrize(("rival", "kept"), [(0.9, 0), (0.7, 1)])
def test_a_found_object_is_not_a_candidate_where_its_name_fits_better(
    rival: float, kept: int
) -> None:
    state = update_candidates(PlannerState(SEARCH), (frame(),), similar_to_sofa(), near_m=1.5)
    state = replace(state, found_objects=(FoundObject("bed", SOFA),))
    after = update_candidates(state, (), similar_to_sofa(rival), near_m=1.5)
    assert len(after.target_state.candidates) == kept


def test_what_the_map_does_not_support_is_kept_apart_with_its_near_views() -> None:
    empty = Detections(
        sequence=2,
        stamp_ns=0,
        detector_id="test",
        names=(),
        boxes_px=np.zeros((0, 4), np.float32),
        scores=np.zeros(0, np.float32),
        points_map=np.zeros((0, 3), np.float32),
        point_owner=np.zeros(0, np.int32),
        independent=True,
    )
    after = update_candidates(
        PlannerState(SEARCH), (frame(), empty, frame()), doubtful(), near_m=1.5
    )
    assert after.target_state.candidates == ()
    (candidate,) = after.target_state.disputed
    assert (candidate.sightings, candidate.cells) == (2, SOFA)
    assert [(tally.hits, tally.frames) for tally in candidate.near_views] == [(2, 3)]


def test_a_rejected_one_comes_back_when_the_map_supports_it() -> None:
    state = update_candidates(PlannerState(SEARCH), (frame(),), doubtful(), near_m=1.5)
    rejected = replace(state, target_state=TargetState(rejected=state.target_state.disputed))
    again = update_candidates(rejected, (frame(),), doubtful(), near_m=1.5)
    assert again.target_state.disputed == ()
    now = update_candidates(rejected, (frame(),), similar_to_sofa(), near_m=1.5)
    assert len(now.target_state.candidates) == 1


def test_no_doubtful_candidate_is_made_of_a_sighting_of_a_supported_one() -> None:
    state = update_candidates(PlannerState(SEARCH), (frame(),), similar_to_sofa(), near_m=1.5)
    after = update_candidates(state, (frame(),), doubtful(), near_m=1.5)
    assert after.target_state.disputed == ()


def test_a_detector_that_reads_the_map_s_features_cannot_outweigh_the_map() -> None:
    dependent = replace(frame(), independent=False)
    after = update_candidates(PlannerState(SEARCH), (dependent,), doubtful(), near_m=1.5)
    assert after.target_state == TargetState()


def test_both_kinds_of_a_candidate_are_rejected_each_by_itself() -> None:
    frames = (frame(), frame())
    state = update_candidates(PlannerState(SEARCH), frames, doubtful(), near_m=1.5)
    state = update_candidates(state, frames, similar_to_sofa(), near_m=1.5)
    (supported,), (without,) = state.target_state.candidates, state.target_state.disputed
    assert without.near_views[0].hits == 2
    left = reject_candidate(state, supported).target_state
    assert (left.candidates, left.disputed) == ((), (without,))
    left = reject_candidate(state, without).target_state
    assert (left.candidates, left.disputed) == ((supported,), ())
