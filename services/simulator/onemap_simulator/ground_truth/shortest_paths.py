"""Any-angle shortest paths through the free cells of a grid, to the nearest of many goals.

Dijkstra over moves of up to three cells, then string pulling.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F64, I64, Bool

# Half of the moves of up to three cells in 32 directions; the others are their reverse. Paths
# along them are within 1.4 % of the shortest, along eight directions within 8 %.
MOVES = [(x, y) for x in range(4) for y in range(-3, 4) if np.gcd(x, y) == 1 and (x, y) > (0, 0)]


@dataclass(frozen=True, slots=True)
class ShortestPaths:
    """Shortest paths from every free cell to the nearest goal.

    free (nx, ny): cells that may be entered; number (nx, ny) int64: row of a free cell in what
    follows, -1 elsewhere; cells (K, 2); lengths (K,) in cells, infinity without a path;
    next_row (K,): the following cell on the path, negative at a goal.
    """

    free: Bool
    number: I64
    cells: I64
    lengths: F64
    next_row: I64

    @classmethod
    def to(cls, goals: Bool, free: Bool) -> ShortestPaths:
        """Paths within the free cells (nx, ny) to any of the goals (nx, ny), themselves free."""
        from scipy.sparse import coo_array  # here: half a second, before anything is asked
        from scipy.sparse.csgraph import dijkstra

        cells = np.argwhere(free)
        number = np.full(free.shape, -1, np.int64)
        number[free] = np.arange(len(cells))
        if not goals.any():
            none = np.full(len(cells), -1, np.int64)
            return cls(free, number, cells, np.full(len(cells), np.inf), none)
        moves, numbers = _moves(free, number)
        lengths, following, _ = dijkstra(
            coo_array((moves, numbers), shape=(len(cells), len(cells))),
            directed=False,
            indices=number[goals],
            min_only=True,
            return_predecessors=True,
        )
        return cls(free, number, cells, lengths, following)

    def length(self, cell: I64) -> float:
        """Length in cells of the path from a free cell (2,), infinity if there is none."""
        path = self.cells_from(cell)
        return string_pulled_length(path, self.free) if len(path) else np.inf

    def cells_from(self, cell: I64) -> I64:
        """The path (N, 2) from a free cell (2,) to a goal, empty if there is none."""
        row = int(self.number[tuple(cell)])
        if not np.isfinite(self.lengths[row]):
            return np.zeros((0, 2), np.int64)
        path = []
        while row >= 0:
            path.append(self.cells[row])
            row = int(self.next_row[row])
        return np.array(path)


def string_pulled_length(cells: I64, free: Bool) -> float:
    """Length in cells of a path (N, 2) after string pulling within the free cells (nx, ny)."""
    length, here = 0.0, 0
    while here < len(cells) - 1:
        ahead = len(cells) - 1
        while ahead > here + 1 and not _line_is_free(cells[here], cells[ahead], free):
            ahead -= 1
        length += float(np.linalg.norm(cells[ahead] - cells[here]))
        here = ahead
    return length


def _moves(free: Bool, number: I64) -> tuple[F64, tuple[I64, I64]]:
    """The moves between free cells that cross free cells only: lengths (M,), and from where to."""
    first, second, lengths = [], [], []
    cells = np.argwhere(free)
    around = np.pad(free, 3)
    for move in MOVES:
        passed = [around[tuple((cells + 3 + step).T)] for step in _line(np.zeros(2), move)]
        starts = cells[np.all(passed, axis=0)]
        first.append(number[tuple(starts.T)])
        second.append(number[tuple((starts + move).T)])
        lengths.append(np.full(len(starts), np.hypot(*move)))
    return np.concatenate(lengths), (np.concatenate(first), np.concatenate(second))


def _line_is_free(start: I64, end: I64, free: Bool) -> bool:
    """Whether the straight line between the centres of two cells crosses free cells only."""
    cells = _line(start, end)
    return bool(free[cells[:, 0], cells[:, 1]].all())


def _line(start: I64 | F64, end: I64 | tuple[int, int]) -> I64:
    """Cells (M, 2), with repeats, at half-cell steps along the line between two cells' centres."""
    apart = np.asarray(end) - start
    steps = 2 * int(np.abs(apart).max()) + 1
    line = start + apart * np.linspace(0.0, 1.0, steps)[:, None]
    cells: I64 = np.floor(line + 0.5).astype(np.int64)
    return cells
