"""Optimal paths over an array of costs, and their smoothing into straight lines.

Costs (nx, ny) are per cell of path, >= 1; negative cells are impassable.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import ndimage
from skimage.graph import MCP_Geometric

from onemap_shared.geometry import F64, I16, I64, Bool
from onemap_shared.grid import GridSpec

SHORTCUT_SLACK = 1.01  # a straight line may cost one percent more than the cells it replaces


@dataclass(frozen=True, slots=True)
class CostToGo:
    """Cheapest paths from one cell to all others: one run of Dijkstra serves all goals.

    cost_m (nx, ny) float64: effort in metres (a metre in the open costs one), infinity where
    no path leads.
    """

    cost_m: F64
    cell_size_m: float
    _paths: Any  # the MCP_Geometric that holds the predecessors
    _back: I16  # (nx, ny) number of the step that leads to a cell

    def path_to(self, cell: tuple[int, int]) -> I64:
        """Cells (N, 2) from the start to ``cell``, 8-connected; the cell must be reachable."""
        return np.asarray(self._paths.traceback(cell), dtype=np.int64)

    def lengths_m(self, cells: I64) -> F64:
        """Lengths (N,) in metres of the cheapest paths to ``cells`` (N, 2), all reachable.

        All paths are walked back at the same time: one by one it took most of the planning time.
        """
        steps = np.vstack([self._paths.offsets, (0, 0), (0, 0)])  # -1: the start, -2: no path
        metres = self.cell_size_m * np.hypot(*steps.T)
        at, lengths = np.array(cells, np.int64), np.zeros(len(cells))
        while True:
            step = self._back[at[:, 0], at[:, 1]]
            if (step < 0).all():
                return lengths
            at -= steps[step]
            lengths += metres[step]


def cost_to_go_from(cost: F64, cell: tuple[int, int], *, cell_size_m: float) -> CostToGo:
    """Costs and paths from ``cell`` over ``cost`` (nx, ny), which must be positive there.

    A step costs its length times the mean of both cells' cost.
    """
    return cost_to_go_from_any(cost, np.array([cell]), cell_size_m=cell_size_m)


def cost_to_go_from_any(cost: F64, cells: I64, *, cell_size_m: float) -> CostToGo:
    """Costs and paths from the nearest of ``cells`` (N, 2), N >= 1, all with positive costs."""
    paths = MCP_Geometric(cost, fully_connected=True)
    cost_cells, back = paths.find_costs(cells.tolist())
    return CostToGo(cell_size_m * cost_cells, cell_size_m, paths, back)


def segment_cells(start: F64, end: F64) -> tuple[I64, F64]:
    """Cells (K, 2) that the straight line between two points (cell units) crosses, in order.

    Cell centres lie at integers. Also returns the length (K,) in cells inside each.
    """
    step = end - start
    cuts = [np.array([0.0, 1.0])]
    for a, d in zip(start, step, strict=True):
        if abs(d) > 1e-9:
            low, high = sorted((a, a + d))
            lines = np.arange(np.floor(low - 0.5) + 1.5, high)
            cuts.append((lines - a) / d)
    t = np.unique(np.clip(np.concatenate(cuts), 0.0, 1.0))
    middle = (t[:-1] + t[1:]) / 2
    cells = np.floor(start + middle[:, None] * step + 0.5).astype(np.int64)
    return cells, np.diff(t) * float(np.hypot(*step))


def line_is_clear(mask: Bool, start: I64, end: I64) -> bool:
    """Whether the mask (nx, ny) is true on the line between the centres of two cells (2,)."""
    cells, _ = segment_cells(start.astype(float), end.astype(float))
    return bool(mask[cells[:, 0], cells[:, 1]].all())


def smooth_path(cost: F64, path: I64) -> I64:
    """Fewer corners (M, 2) of the path (N, 2): straight lines that are passable and cost no more.

    Comparing costs, not only collisions, keeps paths in the middle of doors.
    """
    if len(path) < 3:
        return path
    spent = _cumulative_cost(cost, path)
    corners = [path[0]]
    anchor = 0
    for ahead in range(2, len(path)):
        allowed = (spent[ahead] - spent[anchor]) * SHORTCUT_SLACK
        if not line_cost(cost, path[anchor], path[ahead]) <= allowed:
            anchor = ahead - 1
            corners.append(path[anchor])
    corners.append(path[-1])
    return np.asarray(corners)


def line_cost(cost: F64, start: I64, end: I64) -> float:
    """Integral of the cost (nx, ny) along the line between two cells (2,), in cells.

    Infinite if a cell on the line is impassable.
    """
    cells, lengths = segment_cells(start.astype(float), end.astype(float))
    along = cost[cells[:, 0], cells[:, 1]]
    return float("inf") if (along <= 0).any() else float(along @ lengths)


def _cumulative_cost(cost: F64, path: I64) -> F64:
    """Cost (N,) in cells from the path's start to each of its cells."""
    along = cost[path[:, 0], path[:, 1]]
    lengths = np.hypot(*np.diff(path, axis=0).T)
    return np.concatenate([[0.0], np.cumsum(lengths * (along[:-1] + along[1:]) / 2)])


COARSE_M = 0.3  # cells of the coarse grid: a tenth of the time; no wall is crossed, since the
# cells beside it, 0.25 m on both sides, are no floor for the robot
BEYOND_FACTOR = 1.5  # metres of way for a metre in the air where no way is known yet
IMPASSABLE = -1.0  # as in the costmap


def way_lengths(grid: GridSpec, reachable: Bool, from_xy: F64, to_xy: F64) -> F64:
    """Metres (F, T) of way from points (F, 2) to points (T, 2), metres.

    On reachable floor (nx, ny), on a coarse grid; from its last cell to a point that lies beyond,
    ``BEYOND_FACTOR`` times the distance. Infinite without reachable floor.
    """
    factor = max(round(COARSE_M / grid.cell_size_m), 1)
    size_m = factor * grid.cell_size_m
    coarse = _any_of_blocks(reachable, factor)
    if not coarse.any():
        return np.full((len(from_xy), len(to_xy)), np.inf)
    limit = np.array(coarse.shape) - 1
    start = np.clip(grid.cells(from_xy) // factor, 0, limit)
    end = np.clip(grid.cells(to_xy) // factor, 0, limit)
    away, nearest = ndimage.distance_transform_edt(~coarse, return_indices=True)
    beyond_m = BEYOND_FACTOR * size_m * away
    last: I64 = nearest[:, end[:, 0], end[:, 1]]
    cost = np.where(coarse, 1.0, IMPASSABLE)
    lengths = np.zeros((len(from_xy), len(to_xy)))
    for row, (x, y) in enumerate(start):
        first = (int(nearest[0, x, y]), int(nearest[1, x, y]))
        ways = cost_to_go_from(cost, first, cell_size_m=size_m).cost_m[last[0], last[1]]
        lengths[row] = beyond_m[x, y] + ways + beyond_m[end[:, 0], end[:, 1]]
    return lengths


def _any_of_blocks(mask: Bool, factor: int) -> Bool:
    """Whether any cell of each block of ``factor`` x ``factor`` cells is set."""
    nx, ny = (-(-side // factor) for side in mask.shape)
    padded = np.zeros((nx * factor, ny * factor), bool)
    padded[: mask.shape[0], : mask.shape[1]] = mask
    blocks: Bool = np.any(padded.reshape(nx, factor, ny, factor), axis=(1, 3))
    return blocks
