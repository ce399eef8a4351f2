"""Ways through unknown floor, and where they leave what is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.motion.motions import Pose2d
from onemap_planner.policy.context import PlanningContext, build_context
from onemap_planner.policy.ways import FrontierOnWay, frontier_on_way, visit_counts
from tests.planner.drawn_maps import NO_POINTS, POINT_ROBOT, drawn_map, search_view_of

# Rows run along x, characters along y; cells of 0.5 m. A wall at x = 3 has a door at y = 4.5.
ROOM = (
    "##########",
    "#........#",
    "#........#",
    "#........#",
    "#........#",
    "#........#",
    "########.#",
    *["          "] * 4,
)
CLOSED = (*ROOM[:6], "##########", *ROOM[7:])


def context_of(
    *rows: str, robot_xy: tuple[float, float] = (1.0, 1.0), scale: int = 5
) -> PlanningContext:
    view = search_view_of(drawn_map(*rows, scale=scale))
    return build_context(
        Pose2d(*robot_xy, 0.0), view, trail=(), obstacles_xy=NO_POINTS, params=POINT_ROBOT
    )


def frontier(
    context: PlanningContext, xy: tuple[float, float], closed: np.ndarray | None = None
) -> FrontierOnWay | None:
    if closed is None:
        closed = np.zeros(context.costmap.grid.shape, bool)
    return frontier_on_way(xy, context, closed, within_m=0.5, unknown_cost=1.5)


def xy_of(context: PlanningContext, cell: np.ndarray) -> tuple[float, float]:
    x, y = context.costmap.grid.centres(cell)
    return float(x), float(y)


def test_the_way_into_the_unknown_leads_through_the_door() -> None:
    context = context_of(*ROOM)
    found = frontier(context, (4.5, 1.0))  # just behind the wall
    assert found is not None
    assert xy_of(context, found.cell) == pytest.approx((3.45, 4.25), abs=0.3)
    ahead = xy_of(context, found.ahead)
    assert 3.5 < ahead[0] < 4.1
    assert context.costmap.navigable[tuple(found.cell)]
    assert found.left_m > 3.0


def test_no_way_leads_through_a_closed_wall() -> None:
    assert frontier(context_of(*CLOSED), (4.5, 1.0)) is None


def test_a_known_way_has_no_frontier() -> None:
    assert frontier(context_of(*ROOM), (2.0, 3.0)) is None


def test_the_way_to_a_place_beyond_the_map_leads_towards_it() -> None:
    found = frontier(context_of(*ROOM), (900.0, -4000.0))
    assert found is not None


def test_floor_that_could_not_be_seen_is_closed() -> None:
    context = context_of(*ROOM)
    closed = visit_counts(context, np.array([[3.7, 4.25]])) > 0
    assert frontier(context, (4.5, 1.0), closed) is None


def test_the_robot_s_own_trail_is_closed_too_where_it_could_not_see() -> None:
    context = context_of(*ROOM)
    found = frontier(context, (4.5, 1.0))
    assert found is not None
    passable = np.where(context.costmap.navigable, context.costmap.cost, 10.0)
    trail = replace(context.costmap, cost=passable)  # all that is not N, as a trail outside it
    driven = replace(context, costmap=trail)
    assert frontier(driven, (4.5, 1.0)) is not None
    everywhere = np.ones(trail.grid.shape, bool)
    assert frontier(driven, (4.5, 1.0), everywhere) is None


def test_visits_are_counted_around_each_point() -> None:
    context = context_of(*ROOM)
    counts = visit_counts(context, np.array([[1.05, 1.05], [1.15, 1.05]]))
    grid = context.costmap.grid
    assert counts[tuple(grid.cells(np.array([1.1, 1.1])))] == 2
    assert counts[tuple(grid.cells(np.array([0.6, 1.05])))] == 1
    assert counts[tuple(grid.cells(np.array([2.0, 2.0])))] == 0
    assert visit_counts(context, NO_POINTS).sum() == 0


def test_the_robot_does_not_creep_where_no_camera_saw_the_floor() -> None:
    """Floor that is free because the robot stands on it is where a way may begin, not end."""
    rows = ["......", ".    .", ".    .", ".    .", "......"]
    view = search_view_of(drawn_map(*rows, scale=5))
    trail = ((1.25, 1.0), (1.25, 1.25), (1.25, 1.5))
    params = POINT_ROBOT.model_copy(update={"radius_m": 0.2})
    context = build_context(
        Pose2d(1.25, 1.5, 0.0), view, trail=trail, obstacles_xy=NO_POINTS, params=params
    )
    found = frontier(context, (1.25, 1.0 - 0.35))
    assert found is not None
    robot = context.costmap.grid.cells(np.array([1.25, 1.5]))
    seen = context.map_view.occupancy[tuple(found.cell)] == 1
    assert seen or (found.cell == robot).all()


def test_where_nothing_is_passable_there_is_no_way() -> None:
    context = context_of(*["#" * 6] * 3, "##.###", *["#" * 6] * 3, robot_xy=(1.75, 1.25))
    assert frontier(context, (1.0, 2.25)) is None  # inside the block
    assert frontier(context, (-0.5, 2.25)) is None  # beyond it
