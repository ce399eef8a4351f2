"""The cheapest order of objects: exact for few, never better than exact for many."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from onemap_planner.policy.object_order import (
    MAX_EXACT,
    OrderCosts,
    cheapest_order,
    order_costs,
)
from onemap_shared.geometry import F64


def costs_on_a_line(places_m: list[float], probability: list[float]) -> OrderCosts:
    """Objects on a line, the robot at 0."""
    x = np.array([0.0, *places_m])
    way_m: F64 = np.abs(x[:, None] - x[None, :])
    return order_costs(way_m, np.array(probability), explore_m=15.0, return_m=8.0)


def random_costs(count: int, seed: int) -> OrderCosts:
    rng = np.random.default_rng(seed)
    return OrderCosts(rng.uniform(1, 20, count), rng.uniform(1, 20, (count, count)))


@pytest.mark.parametrize("count", [1, 2, 4, 5])
@pytest.mark.parametrize("seed", [1, 2])
def test_no_order_is_cheaper(count: int, seed: int) -> None:
    costs = random_costs(count, seed)
    least = min(costs.of(order) for order in permutations(range(count)))
    assert costs.of(cheapest_order(costs)) == pytest.approx(least)
    for first in range(count):
        order = cheapest_order(costs, first)
        assert order[0] == first
        least = min(costs.of(o) for o in permutations(range(count)) if o[0] == first)
        assert costs.of(order) == pytest.approx(least)


@pytest.mark.parametrize("count", [MAX_EXACT, MAX_EXACT + 1, 20])
def test_every_object_is_in_the_order_once(count: int) -> None:
    costs = random_costs(count, 3)
    assert sorted(cheapest_order(costs)) == list(range(count))
    assert sorted(cheapest_order(costs, first=4)) == list(range(count))


def test_many_objects_are_taken_the_nearest_next() -> None:
    places = [float(9 - index) for index in range(9)]
    assert cheapest_order(costs_on_a_line(places, [1.0] * 9)) == tuple(range(8, -1, -1))


def test_what_the_map_shows_is_fetched_before_an_exploration() -> None:
    assert cheapest_order(costs_on_a_line([0.0, 4.0], [0.0, 0.9])) == (1, 0)
    assert cheapest_order(costs_on_a_line([0.0, 12.0], [0.0, 0.9])) == (0, 1)


def test_a_doubtful_place_is_visited_from_near() -> None:
    assert cheapest_order(costs_on_a_line([4.0, -4.0], [0.5, 0.9])) == (0, 1)
    assert cheapest_order(costs_on_a_line([4.0, -4.0], [0.9, 0.5])) == (1, 0)
    assert cheapest_order(costs_on_a_line([9.0, -4.0], [0.5, 0.9])) == (1, 0)


def test_equal_orders_are_those_of_the_request() -> None:
    assert cheapest_order(costs_on_a_line([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])) == (0, 1, 2)
