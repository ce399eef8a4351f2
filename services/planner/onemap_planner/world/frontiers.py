"""Frontiers between explored and unexplored, and between free and unknown cells.

The paper has the border between the explored E and the observed O - E. The border of free
floor against unknown cells is added: features of a far wall can be good enough for E before
the floor behind a door was seen, and only this border leads the robot through the door.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from onemap_planner.world.costmap import Costmap
from onemap_planner.world.map_view import CONNECTIVITY_8, MapView
from onemap_shared.geometry import F64, I32, I64, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.jit import compiled
from onemap_shared.messages import Occupancy

MIN_LENGTH_M = 0.4  # shorter borders are gaps that the robot cannot pass
MAX_LENGTH_M = 2.5  # longer borders are cut, so that each piece has a middle near it
MIN_BEYOND_M2 = 0.15  # smaller unknown or unexplored spots are noise
# Similarity expected in ``VIEW_SCALE_M2`` of unknown space: above the usual 0.1 of other objects,
# so that the unknown is preferred to a second look at them.
UNKNOWN_PRIOR = 0.2
# Similarity that no unknown space exceeds, however large: what is clearly like the object comes
# first.
MOST_EXPECTED = 0.6
# Metres of unknown space in view from a frontier that count for what it may show: the depth of a
# room.
VIEW_M = 4.0
# Square metres of unknown space in view for which the prior is expected: a room. More counts in
# proportion: a pocket behind a chair shows 0.3.
VIEW_SCALE_M2 = 16.0
# Similarity that a cell beyond the border loses per metre of way from it: a certain match counts
# for 2.7 m, one below the prior of the unknown sooner.
DECAY_PER_M = 0.3


@dataclass(frozen=True, slots=True)
class Frontier:
    """A segment of a border.

    cells (K, 2) int64: free cells on this side; beyond_xy (2,) metres: middle of what lies
    directly beyond; score in [0, 1]: the highest similarity in O - E reachable there, less
    the way to it, and for a border of the unknown at least what the unknown area in view lets
    expect; ``unknown`` names the kind of border.
    """

    cells: I64
    beyond_xy: F64
    score: float
    unknown: bool


RAYS = 48  # 7.5 degrees: a door of 0.8 m at 3 m is two rays wide


def area_in_view(map_view: MapView, wanted: Bool, viewpoints: I64, range_m: float) -> F64:
    """Area (V,) in square metres of wanted cells within ``range_m`` in sight of cells (V, 2).

    wanted (nx, ny): cells that count; outside the grid all do. Rays run in all directions through
    free and unknown cells and end at occupied ones.
    """
    reach = int(range_m / map_view.grid.cell_size_m)
    steps = np.arange(1, reach + 1)
    angles = 2 * np.pi * np.arange(RAYS) / RAYS
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    offsets = np.rint(directions[:, None] * steps[:, None]).astype(np.int64)
    counts = np.pad(wanted, reach, constant_values=True)
    occupied = np.pad(map_view.occupancy == Occupancy.OCCUPIED, reach)
    strides = np.array([counts.shape[1], 1])
    cells = ((viewpoints + reach) @ strides)[:, None, None] + offsets @ strides
    in_sight = ~np.logical_or.accumulate(occupied.ravel()[cells], axis=-1)  # (V, RAYS, steps)
    ring_m2 = 2 * np.pi / RAYS * steps * map_view.cell_area_m2  # of one ray's step
    area: F64 = ((in_sight & counts.ravel()[cells]) * ring_m2).sum(axis=(-2, -1))
    return area


LEAST_SIMILARITY = 0.05  # less is worth no metre of way
NEIGHBOURS: I64 = np.delete(np.argwhere(CONNECTIVITY_8) - 1, 4, axis=0)


def find_frontiers(map_view: MapView, costmap: Costmap) -> tuple[Frontier, ...]:
    """All frontiers on known free floor, long ones cut; in a fixed order."""
    area_m2 = map_view.cell_area_m2
    unexplored = _without_small_parts(
        map_view.observed & ~map_view.explored, MIN_BEYOND_M2, area_m2
    )
    hidden = (map_view.occupancy == Occupancy.UNKNOWN) & ~costmap.free
    unknown = _without_small_parts(hidden, MIN_BEYOND_M2, area_m2)
    telling = (map_view.occupancy == Occupancy.UNKNOWN) & ~costmap.near_trail
    similarity_beyond = _similarity_beyond(map_view, unexplored, DECAY_PER_M)
    found: list[Frontier] = []
    floor = costmap.free & (map_view.occupancy != Occupancy.UNKNOWN)
    for beyond, on_this_side, is_unknown in (
        (unknown, floor, True),
        (unexplored, floor & map_view.explored, False),
    ):
        border = on_this_side & _beside(beyond)
        segments = _segments(border, map_view.grid.cell_size_m)
        if not len(segments.first):
            continue
        scores = segments.maxima(_around(similarity_beyond, segments.cells).max(axis=0))
        if is_unknown:
            scores = np.maximum(scores, _expected(segments, map_view, telling))
        middles = _middles_beyond(segments, beyond, map_view.grid)
        found += [
            Frontier(cells, beyond_xy, score, is_unknown)
            for cells, beyond_xy, score in zip(
                segments.split, middles, scores.tolist(), strict=True
            )
        ]
    return tuple(found)


@dataclass(frozen=True, slots=True)
class _Segments:
    """Cells (N, 2) of segments one after the other, and which of them is each one's first (S,)."""

    cells: I64
    first: I64

    @property
    def split(self) -> list[I64]:
        """The cells (K, 2) of each segment."""
        return np.split(self.cells, self.first[1:])

    def maxima(self, values: F64) -> F64:
        """The largest (S,) of each segment's values (N,)."""
        largest: F64 = np.maximum.reduceat(values, self.first)
        return largest

    def sums(self, values: F64) -> F64:
        """Sums (S, ...) of each segment's values (N, ...)."""
        total: F64 = np.add.reduceat(values, self.first)
        return total

    def means(self, values: F64) -> F64:
        """Means (S, ...) of each segment's values (N, ...)."""
        mean: F64 = (self.sums(values).T / self.sizes).T
        return mean

    @property
    def sizes(self) -> I64:
        """How many cells each segment has, (S,)."""
        return np.diff(self.first, append=len(self.cells))

    @property
    def middles(self) -> I64:
        """The cell (S, 2) of each segment that is nearest to the mean of its cells."""
        away = self.cells - np.repeat(self.means(self.cells.astype(np.float64)), self.sizes, axis=0)
        segment = np.repeat(np.arange(len(self.first)), self.sizes)
        order = np.lexsort((np.hypot(*away.T), segment))
        middles: I64 = self.cells[order[self.first]]
        return middles


def _without_small_parts(mask: Bool, least_m2: float, cell_area_m2: float) -> Bool:
    """The mask without 8-connected components smaller than ``least_m2``: they are noise."""
    _, parts = cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)
    return _in_large(mask, parts.astype(np.int32, copy=False), least_m2 / cell_area_m2)


@compiled
def _in_large(mask: Bool, parts: I32, least: float) -> Bool:
    """Which cells of the mask are in one of the parts (nx, ny), numbered, of so many cells."""
    sizes = np.zeros(parts.max() + 1, np.int64)
    kept: Bool = mask.copy()
    for x in range(mask.shape[0]):
        for y in range(mask.shape[1]):
            sizes[parts[x, y]] += mask[x, y]
    for x in range(mask.shape[0]):
        for y in range(mask.shape[1]):
            kept[x, y] = mask[x, y] and sizes[parts[x, y]] >= least
    return kept


def _similarity_beyond(map_view: MapView, unexplored: Bool, decay_per_m: float) -> F64:
    """(nx, ny): for cells of O - E the highest similarity, less the way to it; else 0.

    The way runs through O - E alone. What each cell lacks to 1 goes on to its neighbours, with the
    step added, as long as any of them gets less by it: soon few do.
    """
    unpadded = np.s_[1:-1, 1:-1]
    lacking = np.full(np.add(unexplored.shape, 2), -np.inf)  # nothing goes on into other cells
    similarity = np.nan_to_num(map_view.similarity[unexplored], nan=0.0).astype(np.float64)
    lacking[unpadded][unexplored] = np.maximum(1.0 - similarity, 1e-9)
    most = 1.0 - LEAST_SIMILARITY
    decays = np.hypot(*NEIGHBOURS.T) * decay_per_m * map_view.grid.cell_size_m
    jumps = NEIGHBOURS @ np.array([unexplored.shape[1] + 2, 1])
    _pass_on(lacking.ravel(), jumps, decays, most)
    lost = lacking[unpadded][unexplored]
    value = np.zeros(unexplored.shape)
    value[unexplored] = np.where(lost <= most, np.clip(1.0 - lost, 0.0, 1.0), 0.0)
    return value


@compiled
def _pass_on(lacking: F64, jumps: I64, decays: F64, most: float) -> None:
    """Lower what flat cells lack (N,) to that of a neighbour and the step, where it is ``most`` at
    most; a cell waits for its turn in a ring at most once."""
    ring, waits = np.empty(lacking.size, np.int64), np.zeros(lacking.size, np.bool_)
    first, count = 0, 0
    for cell in range(lacking.size):
        if -np.inf < lacking[cell] <= most:
            ring[count], waits[cell] = cell, True
            count += 1
    while count > 0:
        cell = ring[first]
        waits[cell] = False
        first, count = (first + 1) % ring.size, count - 1
        for step in range(len(jumps)):
            there, left = cell + jumps[step], lacking[cell] + decays[step]
            if left < lacking[there]:
                lacking[there] = left
                if left <= most and not waits[there]:
                    ring[(first + count) % ring.size], waits[there] = there, True
                    count += 1


def _beside(mask: Bool) -> Bool:
    """Mask (nx, ny) of the true cells and of those with one at one of their four sides."""
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    return cv2.dilate(mask.astype(np.uint8), cross) > 0


def _segments(border: Bool, cell_size_m: float) -> _Segments:
    """Each component that is long enough, along its principal axis, cut to the longest allowed."""
    _, labels = cv2.connectedComponents(border.astype(np.uint8), connectivity=8)
    cells, number = np.argwhere(border), labels[border].astype(np.int64) - 1
    count = int(number.max(initial=-1)) + 1
    low, high = np.full((count, 2), max(border.shape)), np.full((count, 2), -1)
    np.minimum.at(low, number, cells)
    np.maximum.at(high, number, cells)
    extent = (high - low + 1).max(axis=1, initial=0)
    kept = (extent * cell_size_m >= MIN_LENGTH_M)[number]
    cells, number = cells[kept], number[kept]
    if not len(cells):
        return _Segments(cells, np.zeros(0, np.int64))
    order = np.lexsort((_along(cells, number, count), number))
    cells, number = cells[order], number[order]
    sizes = np.bincount(number, minlength=count)
    rank = np.arange(len(cells)) - (np.cumsum(sizes) - sizes)[number]
    pieces = np.ceil(sizes * cell_size_m / MAX_LENGTH_M)
    piece = np.floor(rank * (pieces / np.maximum(sizes, 1))[number])
    cut = (np.diff(number, prepend=-1) != 0) | (np.diff(piece, prepend=-1) != 0)
    return _Segments(cells, np.flatnonzero(cut))


def _along(cells: I64, number: I64, count: int) -> F64:
    """Coordinate (N,) of cells (N, 2) along the principal axis of the component of that number."""
    sizes = np.maximum(np.bincount(number, minlength=count), 1)

    def mean(values: F64) -> F64:
        return (np.bincount(number, values, count) / sizes)[number]

    x, y = cells.T.astype(np.float64)
    x, y = x - mean(x), y - mean(y)
    angle = np.arctan2(2 * mean(x * y), mean(x * x) - mean(y * y)) / 2
    along: F64 = x * np.cos(angle) + y * np.sin(angle)
    return along


def _around(layer: F64 | Bool, cells: I64) -> F64:
    """Values (9, N) of a layer (nx, ny) in the 3 x 3 blocks around cells (N, 2), 0 outside."""
    x, y = (cells[None] + np.argwhere(CONNECTIVITY_8)[:, None]).transpose(2, 0, 1)
    values: F64 = np.pad(layer, 1)[x, y]
    return values


def _middles_beyond(segments: _Segments, beyond: Bool, grid: GridSpec) -> F64:
    """Middles (S, 2), metres, of what lies directly beyond each segment."""
    outside = _around(beyond, segments.cells)
    offsets_m = (np.argwhere(CONNECTIVITY_8) - 1) * grid.cell_size_m
    count = outside.sum(axis=0)
    total = count[:, None] * grid.centres(segments.cells) + outside.T.astype(np.float64) @ offsets_m
    middles: F64 = segments.sums(total) / segments.sums(count.astype(np.float64))[:, None]
    return middles


def _expected(segments: _Segments, map_view: MapView, telling: Bool) -> F64:
    """What may be expected (S,) beyond segments of the border of the unknown.

    In proportion to the telling area in view from the middle of the frontier, which is the chance
    that the object is in it.
    """
    area_m2 = area_in_view(map_view, telling, segments.middles, VIEW_M)
    return np.minimum(UNKNOWN_PRIOR * area_m2 / VIEW_SCALE_M2, MOST_EXPECTED)
