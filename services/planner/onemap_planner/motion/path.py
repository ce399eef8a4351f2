"""Optimal paths over an array of costs, and their smoothing into straight lines.

Costs (nx, ny) are per cell of path, >= 1; negative cells are impassable.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from onemap_planner.world.least_costs import I8, LENGTHS, STEPS, least_costs, walked
from onemap_shared.geometry import F64, I64, Bool

TOUCH = 1e-9  # cells: a line that is shorter inside a cell meets its corner only
SHORTCUT_SLACK = 1.01  # a straight line may cost one percent more than the cells it replaces


@dataclass(frozen=True, eq=False)
class CostToGo:
    """Cheapest paths from the nearest of some cells to all others: one run of Dijkstra for all.

    It runs when it is first asked for. cost (nx, ny) float64 and cells (N, 2), N >= 1, which have
    positive costs: see ``cost_to_go_from``.
    """

    cost: F64
    cells: I64
    cell_size_m: float

    @cached_property
    def _found(self) -> tuple[F64, I8]:
        """Costs (nx, ny) in metres, and the number of the step that leads to a cell."""
        cost_cells, back = least_costs(self.cost, self.cells)
        return self.cell_size_m * cost_cells, back

    @property
    def cost_m(self) -> F64:
        """Effort (nx, ny) in metres (a metre in the open costs one), infinity without a path."""
        return self._found[0]

    def or_same(self, earlier: CostToGo | None) -> CostToGo:
        """The earlier one if it is of the same cells and costs: it may know the paths already."""
        if earlier is None or earlier.cell_size_m != self.cell_size_m:
            return self
        same = np.array_equal(earlier.cells, self.cells) and np.array_equal(earlier.cost, self.cost)
        return earlier if same else self

    def path_to(self, cell: tuple[int, int]) -> I64:
        """Cells (N, 2) from the start to ``cell``, 8-connected; the cell must be reachable."""
        back, path = self._found[1], [cell]
        while (step := int(back[path[-1]])) >= 0:
            (x, y), (dx, dy) = path[-1], STEPS[step].tolist()
            path.append((x - dx, y - dy))
        return np.array(path[::-1], np.int64)

    def length_m(self, cell: tuple[int, int]) -> float:
        """Length in metres of the cheapest path to ``cell``, which must be reachable."""
        return float(self.lengths_m(np.array([cell]))[0])

    def lengths_m(self, cells: I64) -> F64:
        """Lengths (N,) in metres of the cheapest paths to ``cells`` (N, 2), all reachable."""
        return walked(self._found[1], cells, self.cell_size_m * LENGTHS)


def cost_to_go_from(cost: F64, cell: tuple[int, int], *, cell_size_m: float) -> CostToGo:
    """Costs and paths from ``cell`` over ``cost`` (nx, ny), which must be positive there.

    A step costs its length times the mean of both cells' cost.
    """
    return cost_to_go_from_any(cost, np.array([cell]), cell_size_m=cell_size_m)


def cost_to_go_from_any(cost: F64, cells: I64, *, cell_size_m: float) -> CostToGo:
    """Costs and paths from the nearest of ``cells`` (N, 2), N >= 1, all with positive costs."""
    return CostToGo(cost, cells, cell_size_m)


def line_is_clear(mask: Bool, start: I64, end: I64) -> bool:
    """Whether the mask (nx, ny) is true on the line between the centres of two cells (2,)."""
    return bool(lengths_over(~mask, start[None], end[None])[0] == 0)


def lengths_over(mask: Bool, starts: I64, ends: I64) -> F64:
    """Lengths (N,) in cells over true cells of the lines between the centres of cells (N, 2)."""
    x, y, lengths = _crossed(starts, ends)
    over: F64 = np.where(mask[x, y], lengths, 0.0).sum(axis=1)
    return over


def line_costs(cost: F64, starts: I64, ends: I64) -> F64:
    """Integrals (N,) in cells of the cost (nx, ny) along the lines between cells (N, 2).

    Infinite if a cell on the line is impassable.
    """
    x, y, lengths = _crossed(starts, ends)
    along = cost[x, y]
    spent: F64 = np.where(lengths > 0, along * lengths, 0.0).sum(axis=1)
    return np.where(((along <= 0) & (lengths > 0)).any(axis=1), np.inf, spent)


def _crossed(starts: I64, ends: I64) -> tuple[I64, I64, F64]:
    """Indices (N, K) of the cells under lines between the centres of cells (N, 2), and the lengths
    (N, K), in cells, inside them; 0 where a line only meets a corner."""
    step = (ends - starts).astype(np.float64)
    borders = np.arange(np.abs(step).max(initial=0.0)) + 0.5  # between cells, from the start on
    with np.errstate(divide="ignore"):
        cuts = np.minimum(borders / np.abs(step)[..., None], 1.0)
    sides = np.zeros((len(step), 1)), cuts[:, 0], cuts[:, 1], np.ones((len(step), 1))
    t = np.sort(np.concatenate(sides, axis=1))
    lengths = np.diff(t) * np.hypot(*step.T)[:, None]
    middles = (t[:, 1:] + t[:, :-1])[..., None] / 2 * step[:, None]
    cells = np.floor(starts[:, None] + middles + 0.5).astype(np.int64)
    return cells[..., 0], cells[..., 1], np.where(lengths > TOUCH, lengths, 0.0)


LINES = 32  # tried at once: most straight parts of a path are shorter


def smooth_path(cost: F64, path: I64) -> I64:
    """Fewer corners (M, 2) of the path (N, 2): straight lines that are passable and cost no more.

    Comparing costs, not only collisions, keeps paths in the middle of doors.
    """
    if len(path) < 3:
        return path
    spent = _cumulative_cost(cost, path)
    corners, ahead = [0], 2
    while ahead < len(path):
        tried = slice(ahead, ahead + LINES)
        ends, anchor = path[tried], corners[-1]
        costs = line_costs(cost, np.broadcast_to(path[anchor], ends.shape), ends)
        kept = costs <= (spent[tried] - spent[anchor]) * SHORTCUT_SLACK
        if kept.all():
            ahead += len(ends)
        else:
            first = ahead + int(np.argmin(kept))
            corners.append(first - 1)
            ahead = first + 1
    return path[[*corners, len(path) - 1]]


def _cumulative_cost(cost: F64, path: I64) -> F64:
    """Cost (N,) in cells from the path's start to each of its cells."""
    along = cost[path[:, 0], path[:, 1]]
    lengths = np.hypot(*np.diff(path, axis=0).T)
    return np.concatenate([[0.0], np.cumsum(lengths * (along[:-1] + along[1:]) / 2)])
