"""The methods' switches, the baselines' exploration and VLFM's value map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_perception.config import SHIPPED
from onemap_perception.text.vocabulary import load_table
from onemap_planner.motion.motions import Drive, Rest
from onemap_planner.policy.context import PlanningContext, build_context
from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility
from onemap_planner.policy.move import explore
from onemap_planner.policy.state import LINGER_S, SETTLE_S, PlannerState
from onemap_planner.search.state_machine import Ending
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import camera_mount, pose_2d
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Detections, FeatureField, SearchView, TextEmbeddings
from onemap_tools.bench.navigation import methods
from tests.planner.drawn_maps import PARAMS, drawn_map, search_view_of
from tests.planner.one_room import (
    POSE,
    SEARCH,
    candidate,
    context,
    explored,
    planner_state,
    visited,
)


def seen(*rows: str) -> PlanningContext:
    view = search_view_of(drawn_map(*rows, scale=5))
    return build_context(POSE, view, PARAMS.costmap)


def utility(travel_m: float) -> GoalUtility:
    return GoalUtility.of(0.0, travel_m)


BOTH_ENDS = seen(*["   .........      "] * 10)


def test_the_nearest_frontier_is_chosen_and_kept() -> None:
    state, motion, event, candidates = explored(
        PlannerState(SEARCH), BOTH_ENDS, methods.NEAREST_FRONTIER
    )
    assert isinstance(motion, Drive)
    assert event is None
    assert len(candidates.frontiers) >= 2
    goal = state.active_goal
    assert goal is not None
    again, *_ = explored(replace(state, active_time_s=1.0), BOTH_ENDS, methods.NEAREST_FRONTIER)
    assert again.active_goal == goal
    farthest = methods.FrontierExploration(lambda goal, _: goal.utility.travel_m, margin=0.0)
    other, *_ = explored(state, BOTH_ENDS, farthest)
    assert other.active_goal is not None
    away_m = other.active_goal.goal.utility.travel_m
    assert away_m > goal.goal.utility.travel_m


def test_a_goal_that_takes_too_long_or_was_visited_is_blacklisted() -> None:
    state, *_ = explored(PlannerState(SEARCH), BOTH_ENDS, methods.NEAREST_FRONTIER)
    goal = state.active_goal
    assert goal is not None
    late = replace(state, active_time_s=goal.budget_s + 0.1)
    after, *_ = explored(late, BOTH_ENDS, methods.NEAREST_FRONTIER)
    assert goal.goal.look_xy in after.ledger.visited_frontiers
    there = replace(goal, arrived_s=0.0)
    lingered = replace(state, active_goal=there, active_time_s=LINGER_S)
    after, *_ = explored(lingered, BOTH_ENDS, methods.NEAREST_FRONTIER)
    assert goal.goal.look_xy in after.ledger.visited_frontiers


def test_without_a_frontier_everything_is_tried_once_more_before_it_ends() -> None:
    settle_s = SETTLE_S
    state = planner_state()
    rejected = replace(state.evidence, rejected=(candidate(2.5, 2.5),))
    state = replace(state, evidence=rejected, ledger=visited((1.0, 1.0)))
    state, motion, event, _ = explored(state, context(), methods.NEAREST_FRONTIER)
    assert (motion, event) == (Rest(), None)
    state, *_ = explored(
        replace(state, active_time_s=settle_s + 0.1), context(), methods.NEAREST_FRONTIER
    )
    assert state.reconsidered
    assert state.evidence.rejected == ()
    assert state.ledger.visited_frontiers == ()
    state, *_ = explored(state, context(), methods.NEAREST_FRONTIER)
    late = replace(state, active_time_s=2 * settle_s + 0.2)
    _, _, event, _ = explored(late, context(), methods.NEAREST_FRONTIER)
    assert isinstance(event, Ending)
    assert "no frontier is left on" in event.reason


QUERY = TextEmbeddings(
    "e",
    "s",
    ("bed",),
    np.array([[1.0, 0.0]], np.float32),
    np.zeros((0, 2), np.float32),
    np.zeros((1, 0), np.uint8),
    1.0,
)


NO_POINTS_3D = np.zeros((0, 3), np.float32)
NOTHING = Detections(
    *(1, 1, "d", (), np.zeros((0, 4), np.float32), np.zeros(0, np.float32)),
    *(NO_POINTS_3D, np.zeros(0, np.int32)),
)


def field(feature: tuple[float, ...], yaw_rad: float = 0.0, depth_mm: int = 4000) -> FeatureField:
    """A level camera at (0, 0) that sees a wall everywhere."""
    return FeatureField(
        sequence=1,
        stamp_ns=1,
        encoder_id="e",
        text_space="s",
        features=np.full((3, 4, len(feature)), feature, np.float16),
        variance=np.ones((30, 40), np.float32),
        depth_mm=np.full((30, 40), depth_mm, np.uint16),
        intrinsics=Intrinsics.from_fov(40, 30, np.pi / 2),
        T_map_camera=pose_2d(0.0, 0.0, yaw_rad) @ camera_mount(0.0, 1.0, 0.0),
    )


def similarity(values: methods.ConfidenceValueMap) -> np.ndarray:
    """(2, 3): x = 2.05 and -1.95, y = -2.95, 0.05, 3.05 m."""
    grid = GridSpec(0.1, (-60, -60), (120, 120))
    zeros = np.zeros(grid.shape, np.uint8)
    view = values.view(SearchView("bed", 1, 1, 1, grid, zeros, zeros, zeros.astype(np.float32)))
    assert view.rival.size == 0
    places = np.array([[(x, y) for y in (-2.95, 0.05, 3.05)] for x in (2.05, -1.95)])
    cells = grid.cells(places)
    found: np.ndarray = view.similarity[cells[..., 0], cells[..., 1]]
    return found


def test_confidence_falls_to_the_edge_of_the_image_and_ends_at_walls() -> None:
    places = np.array([[2.0, 0.0], [2.0, 1.0], [2.0, -1.0], [2.0, 2.2], [-2.0, 0.0], [5.0, 0.0]])
    ahead, left, right, beside, behind, beyond = methods.view_confidence(places, field((1.0, 0.0)))
    assert ahead == pytest.approx(1.0)
    assert 0 < left < ahead
    assert left == pytest.approx(right)
    assert (beside, behind, beyond) == (0.0, 0.0, 0.0)


def test_frames_are_averaged_by_confidence_and_forgotten() -> None:
    values = methods.ConfidenceValueMap(0.1)
    assert np.isnan(similarity(values)).all()
    values.add(field((1.0, 0.0)), QUERY, NOTHING)
    values.add(field((0.0, 1.0)), QUERY, NOTHING)
    seen = similarity(values)
    assert seen[0, 1] == pytest.approx(0.75, abs=0.01)
    assert np.isnan(np.delete(seen, 1)).all()
    values.add(field((1.0, 0.0), yaw_rad=np.pi), QUERY, NOTHING)
    assert similarity(values)[1, 1] == pytest.approx(1.0, abs=0.01)
    values.clear()
    assert np.isnan(similarity(values)).all()


OF_WORDS = load_table(SHIPPED)


def words(*names: str) -> TextEmbeddings:
    rows, mask = OF_WORDS.embed(names), np.zeros((len(names), 0), np.uint8)
    return replace(QUERY, texts=names, embeddings=rows, neutral_mask=mask, neutral=rows[:0])


def frontier(company: methods.CompanyMap) -> tuple[float, float]:
    """Where a robot drives first that ranks frontiers so."""
    ranked = methods.FrontierExploration(company.rank, margin=0.0)
    state, *_ = explored(PlannerState(SEARCH), BOTH_ENDS, ranked)
    assert state.active_goal is not None
    return state.active_goal.goal.look_xy


@pytest.mark.parametrize(("sought", "beside"), [("refrigerator", 1), ("pillow", 0)])
def test_the_frontier_near_what_the_object_keeps_company_with_is_chosen(
    sought: str, beside: int
) -> None:
    company, places = methods.CompanyMap(0.1), np.array([[0.8, 3.7, 0], [4.3, 3.7, 0]], np.float32)
    near_m, nearest = 1.6, frontier(company)
    assert {"bed", "oven", "kitchen"} < set(company.names)
    seen = replace(
        NOTHING,
        names=("bed", "oven"),
        boxes_px=np.zeros((2, 4), np.float32),
        scores=np.ones(2, np.float32),
        points_map=places,
        point_owner=np.arange(2, dtype=np.int32),
    )
    queries = words(sought, "bed", "oven", "chair", "bedroom", "kitchen")
    elsewhere = field(tuple(queries.embeddings[4]), yaw_rad=np.pi)
    for _ in range(methods.COMPANY_SIGHTINGS):
        assert frontier(company) == nearest
        company.add(elsewhere, queries, seen)
    chosen = frontier(company)
    assert np.linalg.norm(chosen - places[beside, :2]) <= near_m
    company.clear()
    assert frontier(company) == nearest


def test_a_frontier_in_the_object_s_room_ranks_higher_and_a_near_one_too() -> None:
    def goal(x: float, y: float, travel_m: float) -> Goal:
        return Goal(GoalKind.FRONTIER, (x, y), (x, y), utility(travel_m), "")

    company, context = methods.CompanyMap(0.1), BOTH_ENDS
    here, there = goal(2.0, 0.0, 3.0), goal(-2.0, 0.0, 3.0)
    assert company.rank(here, context) == company.rank(there, context)
    queries = words("refrigerator", "bed", "bedroom", "kitchen")
    for row, yaw_rad in ((3, 0.0), (2, np.pi)):
        company.add(field(tuple(queries.embeddings[row]), yaw_rad), queries, NOTHING)
    in_kitchen, in_bedroom = (company.rank(each, context) for each in (here, there))
    assert in_kitchen == pytest.approx(in_bedroom + 2.0)
    assert company.rank(goal(2.0, 0.0, 1.0), context) > in_kitchen


def test_a_value_map_is_each_episode_s_own() -> None:
    first, second = (methods.search_method("vlfm", 0.1) for _ in range(2))
    assert first.forgets
    assert first.value_map is not None
    assert first.value_map is not second.value_map
    assert methods.search_method("vlfm", 0.1).exploration is not explore


def test_without_similarity_no_cell_is_better_than_another() -> None:
    similarity = np.array([[0.9, np.nan], [0.1, 0.4]], np.float32)
    zeros = np.zeros((2, 2), np.uint8)
    view = SearchView("bed", 1, 1, 1, GridSpec(0.1, (0, 0), (2, 2)), zeros, zeros, similarity)
    changed = methods.without_similarity(view)
    np.testing.assert_array_equal(changed.similarity, [[0, np.nan], [0, 0]])
    assert changed.rival.size == methods.without_rivals(view).rival.size == 0
