"""The methods that the benchmark compares: each a set of switches and planner parameters.

The baselines drive to frontiers, ranked by a rule. A frontier counts as visited when the robot
stood there for ``linger_s`` or needed too long, as in OneMap's own exploration. Without any left
for ``settle_s`` all of them, and rejected candidates, are tried once more; then the object counts
as not found.

VLFM's value map (Yokoyama et al., 2023, "VLFM: Vision-Language Frontier Maps") has one score per
cell for one query: the cosine of the whole image and the text is written to all cells in view; the
confidence is cos^2 of the angle to the optical axis, scaled to 0 at the edge of the image. The
image's embedding is the mean of its patches' features.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from onemap_mapper.query.replies import NO_GRID, NO_RANKS
from onemap_planner.motion.pure_pursuit import arrived
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import SAME_GOAL_M, Goal, SearchAreas, frontier_goals
from onemap_planner.policy.move import Exploration, explore
from onemap_planner.policy.outcome import Move
from onemap_planner.policy.state import LINGER_S, SETTLE_S, ActiveGoal, PlannerState
from onemap_planner.search.state_machine import Ending, Event
from onemap_planner.world.candidates import CONSENSUS, Consensus
from onemap_planner.world.distances import distance_cells
from onemap_planner.world.frontiers import find_frontiers
from onemap_shared.camera import ray_directions, unproject_to_map
from onemap_shared.geometry import F32, F64
from onemap_shared.grid import GridSpec, onto
from onemap_shared.messages import (
    FeatureField,
    SearchState,
    SearchView,
    TextEmbeddings,
)
from onemap_tools.bench.options import MethodName

VALUE_RADIUS_M = 0.5  # around a frontier, as the authors' code
EXTENT_M = 80.0  # side of the value map, around the origin: any apartment
RANGE_M = 8.0  # the camera's; a wall nearer than this ends the view
ANY_DETECTION = Consensus(percentile=0.0, floor=0.0)  # any cell of a detection counts


@dataclass(frozen=True, slots=True)
class SearchMethod:
    """exploration: where to drive while nothing is approached; consensus: when detector and map
    agree; view: changes what the planner sees of the map, None: nothing; value_map: scores cells
    in place of the belief map; forgets: the map and what the planner knows of it are cleared for
    each object."""

    exploration: Exploration = explore
    consensus: Consensus = CONSENSUS
    view: Callable[[SearchView], SearchView] | None = None
    value_map: ConfidenceValueMap | None = None
    forgets: bool = False


ONEMAP = SearchMethod()


def search_method(method: MethodName, cell_size_m: float) -> SearchMethod:
    """The switches of a method that searches on a map of these cells."""
    match method:
        case "onemap_reset":
            return SearchMethod(forgets=True)
        case "onemap_no_consensus":
            return SearchMethod(consensus=ANY_DETECTION, view=without_rivals)
        case "nearest_frontier":
            return SearchMethod(NEAREST_FRONTIER, ANY_DETECTION, without_similarity)
        case "vlfm":
            values = ConfidenceValueMap(cell_size_m)
            return SearchMethod(BEST_VALUE, ANY_DETECTION, value_map=values, forgets=True)
        case _:
            return ONEMAP


def without_rivals(view: SearchView) -> SearchView:
    """The view without competing names."""
    return replace(view, rival=NO_GRID)


def without_similarity(view: SearchView) -> SearchView:
    """The view with similarity 0 in all observed cells and nothing else that words decide."""
    return scored_view(view, view.similarity * np.float32(0))


def scored_view(view: SearchView, similarity: F32) -> SearchView:
    """The layers of a view with this similarity (nx, ny), without what else words decide."""
    return replace(view, similarity=similarity, rival=NO_GRID, guidance=NO_RANKS, calibrated=True)


@dataclass(frozen=True, slots=True)
class FrontierExploration:
    """rank: the higher, the better a goal; margin: by how much another goal must rank higher than
    the present one to replace it."""

    rank: Callable[[Goal, PlanningContext], float]
    margin: float

    def __call__(self, state: PlannerState, context: PlanningContext) -> Move:
        """See ``Exploration``."""
        _give_up_finished(state)
        areas = SearchAreas(find_frontiers(context.map_view, context.costmap))
        goals = [
            goal
            for goal in frontier_goals(areas.frontiers, context)
            if not state.ledger.is_given_up(goal)
        ]
        if not goals:
            return Move(event=_idle(state), areas=areas)
        goal = self._choose(goals, state, context)
        motion = context.drive_to(goal.viewpoint_xy, goal.look_xy)
        there = arrived(motion, context.pose)
        state.active_goal = _active(state, goal).at(state.active_time_s, arrived=there)
        state.idle_since_s = None
        return Move(motion, areas=areas)

    def _choose(self, goals: list[Goal], state: PlannerState, context: PlanningContext) -> Goal:
        ranks = [self.rank(goal, context) for goal in goals]
        best = int(np.argmax(ranks))
        active = state.active_goal
        if active is None:
            return goals[best]
        place = active.goal.look_xy
        same = [i for i, g in enumerate(goals) if g.looks_at(place, SAME_GOAL_M)]
        if not same:
            return goals[best]
        kept = max(same, key=lambda i: ranks[i])
        return goals[kept] if ranks[best] <= ranks[kept] + self.margin else goals[best]


def nearness(goal: Goal, _: PlanningContext) -> float:
    """Rank by the path to the goal, metres: the nearest first."""
    return -goal.utility.travel_m


def frontier_value(goal: Goal, context: PlanningContext) -> float:
    """Rank by the highest value within ``VALUE_RADIUS_M`` of the frontier, as VLFM; 0: none."""
    grid = context.map_view.grid
    away = distance_cells(grid, grid.cells(np.asarray(goal.look_xy))) * grid.cell_size_m
    values = context.map_view.similarity[away <= VALUE_RADIUS_M]
    return float(np.nan_to_num(values, nan=0.0).max(initial=0.0))


NEAREST_FRONTIER = FrontierExploration(nearness, margin=float("inf"))
# VLFM's authors keep a goal until another's cosine is higher by 0.01.
BEST_VALUE = FrontierExploration(frontier_value, margin=0.005)


def _give_up_finished(state: PlannerState) -> None:
    active, now_s = state.active_goal, state.active_time_s
    if active is None:
        return
    visited = active.arrived_s is not None and now_s - active.arrived_s >= LINGER_S
    if visited or now_s - active.since_s > active.budget_s:
        state.give_up(active.goal)


def _active(state: PlannerState, goal: Goal) -> ActiveGoal:
    active = state.active_goal
    if active is not None and goal.looks_at(active.goal.look_xy, SAME_GOAL_M):
        return replace(active, goal=goal)
    return state.new_goal(goal)


def _idle(state: PlannerState) -> Event | None:
    state.active_goal = None
    if state.idle_s() < SETTLE_S:
        return None
    if not state.reconsidered:
        state.reconsider()
        return None
    return Ending(SearchState.NOT_FOUND, f"no frontier is left on {state.known_m2:.0f} m²")


class ConfidenceValueMap:
    """Scores of cells for one object, from all frames since the last ``clear``."""

    def __init__(self, cell_size_m: float) -> None:
        half = round(EXTENT_M / 2 / cell_size_m)
        self._grid = GridSpec(cell_size_m, (-half, -half), (2 * half, 2 * half))
        self.clear()

    def clear(self) -> None:
        """Forget all frames."""
        self._value = np.zeros(self._grid.shape, np.float32)
        self._confidence = np.zeros(self._grid.shape, np.float32)

    def add(self, field: FeatureField, query: TextEmbeddings) -> None:
        """Write the image's score, (1 + cosine) / 2 of its mean feature and the text of ``query``,
        to the cells in view; weights are confidences (VLFM, Eq. 2)."""
        mean = field.features.astype(np.float32).mean(axis=(0, 1))
        cosine = query.embeddings[0] @ mean / max(float(np.linalg.norm(mean)), 1e-6)
        score = (1 + float(cosine)) / 2
        camera = field.T_map_camera[:2, 3]
        corner = self._grid.cells(camera - RANGE_M)
        low = np.clip(corner, 0, self._grid.shape)
        high = np.clip(self._grid.cells(camera + RANGE_M) + 1, 0, self._grid.shape)
        box = (slice(low[0], high[0]), slice(low[1], high[1]))
        cells = np.argwhere(np.ones(high - low, bool)).reshape(*(high - low), 2) + low
        new = view_confidence(self._grid.centres(cells), field)
        old = self._confidence[box]
        total = np.maximum(old + new, np.float32(1e-9))
        seen = new > 0
        value = (old * self._value[box] + new * score) / total
        self._value[box] = np.where(seen, value, self._value[box])
        self._confidence[box] = np.where(seen, (old**2 + new**2) / total, old)

    def view(self, view: SearchView) -> SearchView:
        """The view with the values where the map has any, and no competing names."""
        layers = (self._value, self._confidence)
        value, confidence = (onto(view.grid, self._grid, layer) for layer in layers)
        return scored_view(view, np.where(confidence > 0, value, np.float32(np.nan)))


def view_confidence(places_m: F64, field: FeatureField) -> F32:
    """Confidence (...) of places (..., 2) in metres: 0 where the image does not show them."""
    bearings, ranges_m = column_ranges(field)
    apart = places_m - field.T_map_camera[:2, 3]
    axis = field.T_map_camera[:2, 2]
    ahead = apart @ axis
    left = apart @ np.array([-axis[1], axis[0]])
    angle = np.arctan2(left, ahead)
    half = np.abs(bearings).max()
    reach_m = np.interp(angle, bearings, ranges_m)
    seen = (np.abs(angle) <= half) & (np.hypot(ahead, left) <= reach_m)
    cone = np.cos(angle / half * np.pi / 2) ** 2
    confidence: F32 = np.where(seen, cone, 0.0).astype(np.float32)
    return confidence


def column_ranges(field: FeatureField) -> tuple[F64, F64]:
    """Bearing from the optical axis, ascending (W,), and farthest floor distance (W,) of columns.

    A column without any depth has range 0.
    """
    height, width = field.depth_mm.shape
    rays = ray_directions(field.intrinsics, width, height)[height // 2].astype(np.float64)
    directions = rays @ field.T_map_camera[:3, :3].T
    axis = field.T_map_camera[:2, 2]
    bearings = np.arctan2(
        axis[0] * directions[:, 1] - axis[1] * directions[:, 0], directions[:, :2] @ axis
    )
    depth_m = np.divide(field.depth_mm, 1000, dtype=np.float32)
    points = unproject_to_map(depth_m, field.intrinsics, field.T_map_camera)
    away = np.hypot(*(points[..., :2] - field.T_map_camera[:2, 3]).reshape(-1, 2).T)
    ranges = np.where(field.depth_mm > 0, away.reshape(height, width), 0.0).max(axis=0)
    order = np.argsort(bearings)
    return bearings[order], np.minimum(ranges[order], RANGE_M).astype(np.float64)
