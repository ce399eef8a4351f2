"""Paths are optimal, and smoothing keeps them in N."""

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_planner.motion.path import cost_to_go_from, lengths_over, line_costs, smooth_path
from onemap_shared.geometry import F64, Bool
from tests.planner.drawn_maps import PARAMS, costmap_of, drawn_map
from tests.reference.planning import dijkstra, sampled_line

Cell = tuple[int, int]
cells = st.tuples(st.integers(0, 15), st.integers(0, 15))
costs = arrays(np.float64, (12, 13), elements=st.sampled_from([-1.0, 1.0, 1.0, 1.0, 1.5, 2.0, 4.0]))


@settings(deadline=None, max_examples=60)
@given(costs, st.tuples(st.integers(0, 11), st.integers(0, 12)))
def test_costs_are_optimal(cost: F64, start: tuple[int, int]) -> None:
    cost[start] = 1.0
    cost_to_go = cost_to_go_from(cost, start, cell_size_m=0.5)
    np.testing.assert_allclose(cost_to_go.cost_m, 0.5 * dijkstra(cost, start), rtol=1e-9)


@settings(deadline=None, max_examples=60)
@given(costs, st.tuples(st.integers(0, 11), st.integers(0, 12)))
def test_one_path_is_as_long_as_among_many(cost: F64, start: tuple[int, int]) -> None:
    cost[start] = 1.0
    cost_to_go = cost_to_go_from(cost, start, cell_size_m=0.5)
    ends = np.argwhere(np.isfinite(cost_to_go.cost_m))
    one_by_one = [cost_to_go.length_m((x, y)) for x, y in ends.tolist()]
    assert cost_to_go.lengths_m(ends).tolist() == one_by_one


def test_known_paths_serve_the_same_costs_from_the_same_cell_only() -> None:
    cost = np.ones((5, 5))
    known, dearer = cost_to_go_from(cost, (1, 2), cell_size_m=0.5), cost.copy()
    dearer[4, 4] = 2.0
    assert cost_to_go_from(cost.copy(), (1, 2), cell_size_m=0.5).or_same(known) is known
    others = (
        cost_to_go_from(dearer, (1, 2), cell_size_m=0.5),
        cost_to_go_from(cost, (2, 2), cell_size_m=0.5),
        cost_to_go_from(cost, (1, 2), cell_size_m=0.1),
        cost_to_go_from(cost[:4], (1, 2), cell_size_m=0.5),
    )
    assert all(other.or_same(known) is other for other in others)
    assert known.or_same(None) is known


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
        total += min(float(line_costs(cost, a[None], b[None])[0]), 1e9)
    if len(path) > 1 and total < 1e9:
        assert total * 0.5 <= 1.02 * cost_to_go.cost_m[end] + 1e-9


@given(st.lists(st.tuples(cells, cells), max_size=5), arrays(np.bool_, (16, 16)))
def test_lines_cross_the_cells_under_them(lines: list[tuple[Cell, Cell]], mask: Bool) -> None:
    ends = np.array(lines, np.int64).reshape(-1, 2, 2).swapaxes(0, 1)
    over = lengths_over(mask, *ends)
    for (start, end), length in zip(lines, over, strict=True):
        assert length > 0 or start == end or not any(mask[c] for c in sampled_line(start, end))
    np.testing.assert_allclose(over + lengths_over(~mask, *ends), np.hypot(*(ends[1] - ends[0]).T))


def test_paths_keep_to_the_middle_of_doors() -> None:
    map_view = drawn_map("........", "........", "##..####", "........", "........", scale=5)
    costmap = costmap_of(map_view, (0.5, 3.0), PARAMS.costmap)
    cost_to_go = cost_to_go_from(costmap.cost, (5, 30), cell_size_m=0.1)
    path = smooth_path(costmap.cost, cost_to_go.path_to((20, 30)))
    crossing = []
    for a, b in pairwise(path):
        line = sampled_line((int(a[0]), int(a[1])), (int(b[0]), int(b[1])))
        crossing += [y for x, y in line if 10 <= x < 15]
    assert abs(np.mean(crossing) - 14.5) < 2.0  # the door is cells 10 to 19 wide
