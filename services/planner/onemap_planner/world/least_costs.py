"""Dijkstra's algorithm over the cells of a grid, compiled.

Costs are at least 1, so a step adds at least 1 to the cost of a path: what lies in the same whole
number of costs cannot improve each other, and cells wait in one list for each number, in any order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onemap_shared.geometry import F64, I32, I64
from onemap_shared.jit import compiled

I8 = NDArray[np.int8]

# A step by its number: to the eight neighbours, x first.
STEPS: I64 = np.array([(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)])
LENGTHS: F64 = np.hypot(*STEPS.T)
START, NO_PATH = -1, -2  # in the place of a step
NONE = -1


def least_costs(cost: F64, starts: I64) -> tuple[F64, I8]:
    """Cost (nx, ny) in cells from the nearest of the cells ``starts`` (N, 2), infinity without a
    path, and the number of the step that leads to each cell.

    cost (nx, ny): per cell of path, >= 1; others are impassable. A step costs its length times the
    mean of both cells' cost.
    """
    # With a border that is impassable. What is impassable costs minus infinity: no way to it is
    # cheaper.
    own = np.pad(np.asarray(cost, np.float64), 1, constant_values=-1.0)
    total = np.where(own > 0, np.inf, -np.inf)
    back = np.full(own.shape, NO_PATH, np.int8)
    width = own.shape[1]
    longest = float(LENGTHS.max() * max(own.max(), 1.0))  # step; no list is met a second time
    lists = _Lists(
        np.full(int(longest) + 3, NONE, np.int32),
        *(np.full(own.size, NONE, np.int32) for _ in range(3)),
    )
    flat = _Grid(own.ravel(), total.ravel(), back.ravel(), STEPS @ np.array([width, 1]), LENGTHS)
    _spread(flat, lists, (np.asarray(starts, np.int64) + 1) @ np.array([width, 1]))
    inside = np.s_[1:-1, 1:-1]
    return np.where(total >= 0, total, np.inf)[inside], np.ascontiguousarray(back[inside])


def walked(back: I8, cells: I64, step_m: F64) -> F64:
    """Summed lengths (N,) of the steps (8,) on the ways to cells (N, 2), which all have one."""
    return _walked(back, np.array(cells, np.int64), step_m, STEPS)


@compiled
def _walked(back: I8, cells: I64, step_m: F64, steps: I64) -> F64:
    lengths = np.zeros(len(cells))
    for number in range(len(cells)):
        x, y = cells[number]
        while back[x, y] >= 0:
            step = back[x, y]
            lengths[number] += step_m[step]
            x -= steps[step, 0]
            y -= steps[step, 1]
    return lengths


class _Grid(NamedTuple):
    """A flat grid: costs of the cells, of the cheapest paths to them, the steps that lead there;
    and of each step how many cells it goes on, and its length."""

    own: F64
    total: F64
    back: I8
    jumps: I64
    lengths: F64


class _Lists(NamedTuple):
    """Cells that wait, doubly linked: the first of each list, and by cell the one that follows, the
    one before, and its list."""

    first: I32
    following: I32
    before: I32
    member: I32


@compiled
def _put(lists: _Lists, cell: int, new: int) -> None:
    """Take a cell out of its list, if it is in one, and put it first into another."""
    old, head = lists.member[cell], lists.first[new]
    if old != NONE:
        earlier, later = lists.before[cell], lists.following[cell]
        if earlier == NONE:
            lists.first[old] = later
        else:
            lists.following[earlier] = later
        if later != NONE:
            lists.before[later] = earlier
    lists.member[cell], lists.following[cell], lists.before[cell] = new, head, NONE
    if head != NONE:
        lists.before[head] = cell
    lists.first[new] = cell


@compiled
def _spread(grid: _Grid, lists: _Lists, starts: I64) -> None:
    """Fill in total costs and steps from the flat cells ``starts`` (N,)."""
    own, total, count, waiting, now = grid.own, grid.total, len(lists.first), 0, 0
    for cell in starts:
        if grid.back[cell] == NO_PATH:
            total[cell], grid.back[cell] = 0.0, START
            _put(lists, cell, 0)
            waiting += 1
    while waiting > 0:
        cell = lists.first[now % count]
        while cell != NONE:
            waiting -= 1
            for step in range(8):
                there = cell + grid.jumps[step]
                if total[there] <= total[cell] + 1.0:
                    continue
                after = total[cell] + grid.lengths[step] * (0.5 * (own[cell] + own[there]))
                if after < total[there]:
                    total[there], grid.back[there] = after, step
                    new = int(after) % count
                    waiting += lists.member[there] == NONE
                    if lists.member[there] != new:
                        _put(lists, there, new)
            cell = lists.following[cell]
        lists.first[now % count] = NONE
        now += 1
