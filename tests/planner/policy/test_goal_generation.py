"""Goals have a reachable viewpoint and a reason."""

import numpy as np
import pytest

from onemap_planner.policy.goals import frontier_goals, region_goals
from onemap_planner.world.frontiers import find_frontiers
from onemap_planner.world.regions import SimilarRegion
from tests.planner.drawn_maps import NO_POINTS, PARAMS, costmap_and_cost_to_go, drawn_map


def test_a_frontier_s_goal_is_reachable_and_says_why() -> None:
    map_view = drawn_map("#######  ", "#......  ", "#.....#  ", "#######  ", scale=5)
    costmap, cost_to_go = costmap_and_cost_to_go(map_view, (0.8, 0.8), PARAMS.costmap)
    frontiers = find_frontiers(map_view, costmap, PARAMS.frontier)
    (found,) = frontier_goals(frontiers, costmap, cost_to_go, params=PARAMS.goal)
    cell = costmap.grid.cells(np.array(found.viewpoint_xy))
    assert costmap.navigable[tuple(cell)]
    assert found.utility.travel_m == pytest.approx(cost_to_go.lengths_m(cell[None])[0])
    assert found.utility.travel_m < float(cost_to_go.cost_m[tuple(cell)])
    assert "unknown space" in found.reason
    assert found.look_xy[1] > 3.4


def test_a_frontier_behind_a_wall_is_no_goal() -> None:
    map_view = drawn_map("#####  ", "#..#.  ", "#..#.  ", "#####  ", scale=5)
    costmap, cost_to_go = costmap_and_cost_to_go(map_view, (0.9, 0.9), PARAMS.costmap)
    frontiers = find_frontiers(map_view, costmap, PARAMS.frontier)
    assert frontiers
    assert frontier_goals(frontiers, costmap, cost_to_go, params=PARAMS.goal) == []


def test_a_region_is_viewed_from_the_band_with_a_line_of_sight() -> None:
    map_view = drawn_map(*["......."] * 6, scale=5)
    costmap, cost_to_go = costmap_and_cost_to_go(map_view, (0.4, 0.4), PARAMS.costmap)
    target = np.array([[20, 20]])
    region = SimilarRegion(target, costmap.grid.centres(target[0]), 0.9)
    (found,) = region_goals((region,), costmap, cost_to_go, tried_xy=NO_POINTS, params=PARAMS.goal)
    away = np.hypot(*(np.array(found.viewpoint_xy) - region.peak_xy))
    assert PARAMS.goal.view_nearest_m <= away <= PARAMS.goal.view_farthest_m
    assert found.look_xy == pytest.approx(tuple(region.peak_xy))
    assert "0.90" in found.reason


def test_an_unreachable_region_is_no_goal() -> None:
    map_view = drawn_map("..#######", "..#######", "..#######", scale=5)
    costmap, cost_to_go = costmap_and_cost_to_go(map_view, (0.4, 0.4), PARAMS.costmap)
    far = SimilarRegion(np.array([[5, 40]]), np.array([0.55, 4.05]), 0.9)
    assert region_goals((far,), costmap, cost_to_go, tried_xy=NO_POINTS, params=PARAMS.goal) == []
