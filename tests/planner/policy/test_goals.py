"""Goals stand where they can see, and are kept until another is clearly better."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_planner.policy.goals import Goal, GoalKind, Worth, choose, frontier_goals, region_goals
from onemap_planner.policy.viewpoints import (
    TRIED_M,
    Stands,
    least_hidden_stand,
    seeing_stand,
    stands_around,
)
from onemap_planner.world.frontiers import find_frontiers
from onemap_planner.world.regions import Region
from tests.planner.drawn_maps import NO_PLACES, RULES, drawn, standing


def goal(utility: float, x: float = 0.0, kind: GoalKind = GoalKind.FRONTIER) -> Goal:
    return Goal(kind, (x, 0.0), (x, 0.0), Worth(utility, 0.0, 0.0, 0.0), "")


def test_the_best_is_chosen() -> None:
    assert choose([goal(0.1), goal(0.4, 5.0), goal(0.2, 9.0)], None, RULES.goal) == goal(0.4, 5.0)
    assert choose([], goal(1.0), RULES.goal) is None


def test_the_current_goal_is_kept_unless_another_is_clearly_better() -> None:
    current = goal(0.3, 1.0)
    today = goal(0.3, 1.2)
    assert choose([today, goal(0.38, 5.0)], current, RULES.goal) == today
    assert choose([today, goal(0.45, 5.0)], current, RULES.goal) == goal(0.45, 5.0)
    assert choose([goal(0.1, 5.0)], current, RULES.goal) == goal(0.1, 5.0)  # it is gone


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(-9, 9)), min_size=1, max_size=8), st.data())
def test_the_choice_does_not_depend_on_the_order(
    values: list[tuple[float, float]], data: st.DataObject
) -> None:
    goals = [goal(u, x) for u, x in values]
    shuffled = data.draw(st.permutations(goals))
    assert choose(goals, None, RULES.goal) == choose(shuffled, None, RULES.goal)


def test_worth_adds_up() -> None:
    worth = Worth(score=0.5, size_bonus=0.1, travel_m=5.0, travel_penalty=0.2)
    assert worth.utility == pytest.approx(0.4)


def test_a_frontier_s_goal_is_reachable_and_says_why() -> None:
    belief = drawn("#######  ", "#......  ", "#.....#  ", "#######  ", scale=5)
    terrain, reach = standing(belief, (0.8, 0.8), RULES.terrain)
    frontiers = find_frontiers(belief, terrain, RULES.frontier)
    (found,) = frontier_goals(frontiers, terrain, reach, rules=RULES.goal)
    cell = terrain.grid.cells(np.array(found.stand_xy))
    assert terrain.navigable[tuple(cell)]
    assert found.worth.travel_m == pytest.approx(float(reach.cost_m[tuple(cell)]))
    assert "unknown space" in found.reason
    assert found.look_xy[1] > 3.4


def test_a_frontier_behind_a_wall_is_no_goal() -> None:
    belief = drawn("#####  ", "#..#.  ", "#..#.  ", "#####  ", scale=5)
    terrain, reach = standing(belief, (0.9, 0.9), RULES.terrain)
    frontiers = find_frontiers(belief, terrain, RULES.frontier)
    assert frontiers
    assert frontier_goals(frontiers, terrain, reach, rules=RULES.goal) == []


def test_a_region_is_viewed_from_the_band_with_a_line_of_sight() -> None:
    belief = drawn(*["......."] * 6, scale=5)
    terrain, reach = standing(belief, (0.4, 0.4), RULES.terrain)
    target = np.array([[20, 20]])
    region = Region(target, terrain.grid.centres(target[0]), 0.9)
    (found,) = region_goals((region,), terrain, reach, tried_xy=NO_PLACES, rules=RULES.goal)
    away = np.hypot(*(np.array(found.stand_xy) - region.peak_xy))
    assert RULES.goal.view_nearest_m <= away <= RULES.goal.view_farthest_m
    assert found.look_xy == pytest.approx(tuple(region.peak_xy))
    assert "0.90" in found.reason


NOBODY = np.zeros((0, 2), np.int64)


def around(target: list[list[int]], tried: list[list[int]] | None = None) -> Stands:
    """Stands left of a wall (cells 30 to 34), for a target right of it."""
    belief = drawn(*["......#......"] * 4, scale=5)
    terrain, reach = standing(belief, (0.5, 0.5), RULES.terrain)
    vain = np.array(tried or [], np.int64).reshape(-1, 2)
    return stands_around(np.array(target), terrain, reach, band_m=(0.5, 1.4), tried=vain)


def test_nothing_is_seen_through_a_wall_unless_it_was_seen_from_there() -> None:
    stands = around([[10, 39]])
    assert seeing_stand(stands, NOBODY) is None
    stand = seeing_stand(stands, np.array([[10, 5]]))
    assert stand is not None
    assert stand[1] < 30


def test_as_a_last_resort_the_least_hidden_stand_is_taken() -> None:
    stand = least_hidden_stand(around([[10, 39]]))
    assert stand is not None
    assert stand[1] < 30
    straight = abs(int(stand[0]) - 10)
    assert straight <= 3  # across the wall, not along it
    assert least_hidden_stand(around([[10, 55]])) is None  # nothing reachable is near


def test_no_stand_near_one_tried_in_vain_is_offered_again() -> None:
    first = least_hidden_stand(around([[10, 39]]))
    assert first is not None
    second = least_hidden_stand(around([[10, 39]], [first.tolist()]))
    assert second is None or np.hypot(*(second - first)) * 0.1 > TRIED_M


def test_an_unreachable_region_is_no_goal() -> None:
    belief = drawn("..#######", "..#######", "..#######", scale=5)
    terrain, reach = standing(belief, (0.4, 0.4), RULES.terrain)
    far = Region(np.array([[5, 40]]), np.array([0.55, 4.05]), 0.9)
    assert region_goals((far,), terrain, reach, tried_xy=NO_PLACES, rules=RULES.goal) == []
