"""Detections become candidates, except rejected ones and objects found before."""

from dataclasses import replace

import numpy as np

from onemap_planner.motion.motions import Pose2d
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.state import Evidence, PlannerState
from onemap_planner.world.map_view import WorldCells
from onemap_shared.messages import Detections, Occupancy
from tests.planner.drawn_maps import detections_of
from tests.planner.one_room import SEARCH, context, having_seen, rejecting

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
    points = [[(x + 0.5) / 10, (y + 0.5) / 10, 0.5] for x, y in sorted(SOFA)]
    return detections_of({name: points}, independent=True)


def test_what_the_map_does_not_support_is_kept_apart_with_its_near_views() -> None:
    empty = detections_of({}, independent=True)
    after = having_seen(PlannerState(SEARCH), (frame(), empty, frame()), doubtful())
    assert after.evidence.candidates == ()
    (candidate,) = after.evidence.unsupported
    assert (candidate.sightings, candidate.cells) == (2, SOFA)
    assert [(tally.hits, tally.frames) for tally in candidate.near_views] == [(2, 3)]


def test_a_detector_that_reads_the_map_s_features_cannot_outweigh_the_map() -> None:
    dependent = replace(frame(), independent=False)
    after = having_seen(PlannerState(SEARCH), (dependent,), doubtful())
    assert after.evidence == Evidence()


def test_both_kinds_of_a_candidate_are_rejected_each_by_itself() -> None:
    frames = (frame(), frame())
    state = having_seen(PlannerState(SEARCH), frames, doubtful())
    state = having_seen(state, frames, similar_to_sofa())
    (supported,), (without,) = state.evidence.candidates, state.evidence.unsupported
    assert without.near_views[0].hits == 2
    left = rejecting(state, supported).evidence
    assert (left.candidates, left.unsupported) == ((), (without,))
    left = rejecting(state, without).evidence
    assert (left.candidates, left.unsupported) == ((supported,), ())
