"""Goals stand where they can see, and are kept until another is clearly better."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_planner.policy.goal_generation import frontier_goals, region_goals
from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility, select_goal
from onemap_planner.policy.viewpoints import (
    TRIED_M,
    Viewpoints,
    first_visible,
    least_occluded,
    viewpoints_around,
)
from onemap_planner.world.frontiers import find_frontiers
from onemap_planner.world.regions import SimilarRegion
from tests.planner.drawn_maps import NO_POINTS, PARAMS, costmap_and_cost_to_go, drawn_map


def goal(total: float, x: float = 0.0, kind: GoalKind = GoalKind.FRONTIER) -> Goal:
    return Goal(kind, (x, 0.0), (x, 0.0), GoalUtility(total, 0.0, 0.0, 0.0), "")


def test_the_best_is_chosen() -> None:
    assert select_goal([goal(0.1), goal(0.4, 5.0), goal(0.2, 9.0)], None, PARAMS.goal) == goal(
        0.4, 5.0
    )
    assert select_goal([], goal(1.0), PARAMS.goal) is None


def test_the_current_goal_is_kept_unless_another_is_clearly_better() -> None:
    current = goal(0.3, 1.0)
    today = goal(0.3, 1.2)
    assert select_goal([today, goal(0.38, 5.0)], current, PARAMS.goal) == today
    assert select_goal([today, goal(0.45, 5.0)], current, PARAMS.goal) == goal(0.45, 5.0)
    assert select_goal([goal(0.1, 5.0)], current, PARAMS.goal) == goal(0.1, 5.0)  # it is gone


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(-9, 9)), min_size=1, max_size=8), st.data())
def test_the_choice_does_not_depend_on_the_order(
    values: list[tuple[float, float]], data: st.DataObject
) -> None:
    goals = [goal(u, x) for u, x in values]
    shuffled = data.draw(st.permutations(goals))
    assert select_goal(goals, None, PARAMS.goal) == select_goal(shuffled, None, PARAMS.goal)


def test_worth_adds_up() -> None:
    utility = GoalUtility(score=0.5, size_bonus=0.1, travel_m=5.0, travel_penalty=0.2)
    assert utility.total == pytest.approx(0.4)


def test_a_frontier_s_goal_is_reachable_and_says_why() -> None:
    map_view = drawn_map("#######  ", "#......  ", "#.....#  ", "#######  ", scale=5)
    costmap, cost_to_go = costmap_and_cost_to_go(map_view, (0.8, 0.8), PARAMS.costmap)
    frontiers = find_frontiers(map_view, costmap, PARAMS.frontier)
    (found,) = frontier_goals(frontiers, costmap, cost_to_go, params=PARAMS.goal)
    cell = costmap.grid.cells(np.array(found.viewpoint_xy))
    assert costmap.navigable[tuple(cell)]
    assert found.utility.travel_m == pytest.approx(float(cost_to_go.cost_m[tuple(cell)]))
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


NOBODY = np.zeros((0, 2), np.int64)


def around(target: list[list[int]], tried: list[list[int]] | None = None) -> Viewpoints:
    """Stands left of a wall (cells 30 to 34), for a target right of it."""
    map_view = drawn_map(*["......#......"] * 4, scale=5)
    costmap, cost_to_go = costmap_and_cost_to_go(map_view, (0.5, 0.5), PARAMS.costmap)
    vain = np.array(tried or [], np.int64).reshape(-1, 2)
    return viewpoints_around(np.array(target), costmap, cost_to_go, band_m=(0.5, 1.4), tried=vain)


def test_nothing_is_seen_through_a_wall_unless_it_was_seen_from_there() -> None:
    viewpoints = around([[10, 39]])
    assert first_visible(viewpoints, NOBODY) is None
    viewpoint = first_visible(viewpoints, np.array([[10, 5]]))
    assert viewpoint is not None
    assert viewpoint[1] < 30


def test_as_a_last_resort_the_least_hidden_stand_is_taken() -> None:
    viewpoint = least_occluded(around([[10, 39]]))
    assert viewpoint is not None
    assert viewpoint[1] < 30
    straight = abs(int(viewpoint[0]) - 10)
    assert straight <= 3  # across the wall, not along it
    assert least_occluded(around([[10, 55]])) is None  # nothing reachable is near


def test_no_stand_near_one_tried_in_vain_is_offered_again() -> None:
    first = least_occluded(around([[10, 39]]))
    assert first is not None
    second = least_occluded(around([[10, 39]], [first.tolist()]))
    assert second is None or np.hypot(*(second - first)) * 0.1 > TRIED_M


def test_an_unreachable_region_is_no_goal() -> None:
    map_view = drawn_map("..#######", "..#######", "..#######", scale=5)
    costmap, cost_to_go = costmap_and_cost_to_go(map_view, (0.4, 0.4), PARAMS.costmap)
    far = SimilarRegion(np.array([[5, 40]]), np.array([0.55, 4.05]), 0.9)
    assert region_goals((far,), costmap, cost_to_go, tried_xy=NO_POINTS, params=PARAMS.goal) == []
