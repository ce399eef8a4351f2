"""Paths are optimal, and smoothing keeps them in N."""

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_planner.motion.path import (
    cost_to_go_from,
    line_cost,
    line_is_clear,
    segment_cells,
    smooth_path,
)
from onemap_shared.geometry import F64
from tests.planner.drawn_maps import PARAMS, costmap_of, drawn_map
from tests.reference.planning import dijkstra, sampled_line

cells = st.tuples(st.integers(0, 15), st.integers(0, 15))
costs = arrays(np.float64, (12, 13), elements=st.sampled_from([-1.0, 1.0, 1.0, 1.0, 1.5, 2.0, 4.0]))


@settings(deadline=None, max_examples=60)
@given(costs, st.tuples(st.integers(0, 11), st.integers(0, 12)))
def test_costs_are_optimal(cost: F64, start: tuple[int, int]) -> None:
    cost[start] = 1.0
    cost_to_go = cost_to_go_from(cost, start, cell_size_m=0.5)
    np.testing.assert_allclose(cost_to_go.cost_m, 0.5 * dijkstra(cost, start), rtol=1e-9)


@settings(deadline=None, max_examples=60)
@given(costs, st.tuples(st.integers(0, 11), st.integers(0, 12)), st.integers(0, 10**6))
def test_smoothing_stays_passable_and_costs_no_more(
    cost: F64, start: tuple[int, int], pick: int
) -> None:
    cost[start] = 1.0
    cost_to_go = cost_to_go_from(cost, start, cell_size_m=0.5)
    ends = np.argwhere(np.isfinite(cost_to_go.cost_m))
    end = tuple(ends[pick % len(ends)])
    path = cost_to_go.path_to((int(end[0]), int(end[1])))
    corners = smooth_path(cost, path)
    assert tuple(corners[0]) == start
    assert tuple(corners[-1]) == end
    # A step of the grid may pass between two impassable corners; lines may not.
    steps = [tuple(cell) for cell in path]
    total = 0.0
    for a, b in pairwise(corners):
        adjacent = max(abs(a - b)) == 1 and steps.index(tuple(b)) == steps.index(tuple(a)) + 1
        crossed = sampled_line((int(a[0]), int(a[1])), (int(b[0]), int(b[1])))
        assert adjacent or all(cost[cell] > 0 for cell in crossed)
        total += min(line_cost(cost, a, b), 1e9)
    if len(path) > 1 and total < 1e9:
        assert total * 0.5 <= 1.02 * cost_to_go.cost_m[end] + 1e-9


@given(cells, cells)
def test_a_segment_crosses_the_cells_under_it(start: tuple[int, int], end: tuple[int, int]) -> None:
    crossed, lengths = segment_cells(np.array(start, float), np.array(end, float))
    assert sampled_line(start, end) <= {(int(x), int(y)) for x, y in crossed}
    assert len(crossed) == len(lengths)
    np.testing.assert_allclose(lengths.sum(), np.hypot(*np.subtract(end, start)), atol=1e-9)


def test_a_line_is_blocked_by_one_cell() -> None:
    mask = np.ones((5, 5), bool)
    assert line_is_clear(mask, np.array([0, 0]), np.array([4, 3]))
    mask[2, 2] = False
    assert not line_is_clear(mask, np.array([0, 0]), np.array([4, 4]))


def test_a_path_in_the_open_becomes_one_line() -> None:
    costmap = costmap_of(drawn_map(*["." * 6] * 6, scale=5), (1.0, 1.0), PARAMS.costmap)
    path = cost_to_go_from(costmap.cost, (5, 5), cell_size_m=0.1).path_to((25, 14))
    assert smooth_path(costmap.cost, path).tolist() == [[5, 5], [25, 14]]


def test_paths_keep_to_the_middle_of_doors() -> None:
    map_view = drawn_map("........", "........", "##..####", "........", "........", scale=5)
    costmap = costmap_of(map_view, (0.5, 3.0), PARAMS.costmap)
    cost_to_go = cost_to_go_from(costmap.cost, (5, 30), cell_size_m=0.1)
    path = smooth_path(costmap.cost, cost_to_go.path_to((20, 30)))
    crossing = []
    for a, b in pairwise(path):
        line, _ = segment_cells(a.astype(float), b.astype(float))
        crossing += [y for x, y in line if 10 <= x < 15]
    assert abs(np.mean(crossing) - 14.5) < 2.0  # the door is cells 10 to 19 wide
