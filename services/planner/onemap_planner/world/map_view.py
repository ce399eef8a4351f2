"""The view of the map for one object: kept up to date by its changes; its layers in a window."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from onemap_shared.geometry import F32, F64, I64, U8, Bool
from onemap_shared.grid import GridSpec, onto
from onemap_shared.joint_belief import by_rank
from onemap_shared.messages import (
    NO_VIEW,
    TILE_CELLS,
    Layer,
    Occupancy,
    SearchView,
    ViewChanges,
    ViewKey,
    ranked,
)

CONNECTIVITY_8 = np.ones((3, 3), bool)  # diagonal neighbours are neighbours


def components(mask: Bool) -> list[I64]:
    """Cells (K, 2) of each 8-connected component of the mask (nx, ny), row by row."""
    count, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)
    cells, label = np.argwhere(mask), labels[mask]
    sizes = np.bincount(label, minlength=count)[1:]
    return np.split(cells[np.argsort(label, kind="stable")], np.cumsum(sizes))[: count - 1]


SIMILARITY, COSINE, RIVAL = range(3)  # rows of the values of a message


class ChangesDoNotFit(ValueError):
    """Changes that lead on from another state than the one at hand: ask for everything."""


@dataclass(frozen=True, slots=True)
class AssembledView:
    """One state of a view, with the meaning of ``SearchView``.

    occupancy and layers (nx, ny) uint8; values (p, nx, ny) float32, NaN where not observed, and
    rank_limits as in ``ViewChanges``.
    """

    text: str
    key: ViewKey
    revision: int
    sequence: int
    stamp_ns: int
    grid: GridSpec
    occupancy: U8
    layers: U8
    values: F32
    rank_limits: F32
    calibrated: bool = True
    coloured: bool = False

    @property
    def map_id(self) -> str:
        """See ``SearchView``."""
        return self.key.map_id

    def whole(self) -> SearchView:
        """The whole view, as the mapper replies to ``SearchViewRequest``."""
        planes, nothing = len(self.values) - self.coloured, np.zeros((0, 0), np.float32)
        guidance, unseen = nothing.astype(np.uint8), nothing
        if planes:
            ranks = ranked(self.values[COSINE], self.rank_limits)
            guidance = np.where(np.isnan(self.values[COSINE]), 0, ranks).astype(np.uint8)
        elif self.text:
            unseen = np.full(self.grid.shape, np.nan, np.float32)
        return SearchView(
            text=self.text,
            revision=self.revision,
            sequence=self.sequence,
            stamp_ns=self.stamp_ns,
            grid=self.grid,
            occupancy=self.occupancy,
            layers=self.layers,
            similarity=self.values[SIMILARITY] if planes else unseen,
            rival=self.values[RIVAL] if planes > RIVAL else nothing,
            guidance=guidance,
            calibrated=self.calibrated,
            map_id=self.map_id,
            likeness=self.values[-1] if self.coloured else nothing,
        )


def with_changes(view: AssembledView | None, changes: ViewChanges) -> AssembledView:
    """The view with these changes. Raises ``ChangesDoNotFit`` if they lead on from another one."""
    grid, planes = changes.grid, len(changes.values)
    occupancy = np.full(grid.shape, Occupancy.UNKNOWN, np.uint8)
    layers = np.zeros(grid.shape, np.uint8)
    values = np.full((planes, *grid.shape), np.nan, np.float32)
    if changes.base != NO_VIEW:
        if view is None or (view.key, view.text) != (changes.base, changes.text):
            raise ChangesDoNotFit("the changes of the map's view lead on from another view")
        if len(view.values) != planes or not _holds(grid, view.grid):
            raise ChangesDoNotFit("the changes of the map's view do not fit the view")
        occupancy = onto(grid, view.grid, view.occupancy, Occupancy.UNKNOWN)
        layers = onto(grid, view.grid, view.layers)
        for plane, before in zip(values, view.values, strict=True):
            plane[:] = onto(grid, view.grid, before, np.nan)
    tile, cell = np.nonzero(np.unpackbits(changes.cells, axis=1))
    first = TILE_CELLS * changes.tiles[tile] - np.asarray(grid.origin_cell)
    x, y = first[:, 0] + cell // TILE_CELLS, first[:, 1] + cell % TILE_CELLS
    occupancy[x, y], layers[x, y] = changes.occupancy, changes.layers
    observed = (changes.layers & Layer.OBSERVED) > 0
    if planes:
        values[:, x, y] = np.nan
        values[:, x[observed], y[observed]] = changes.values
    return AssembledView(
        changes.text,
        changes.key,
        changes.revision,
        changes.sequence,
        changes.stamp_ns,
        grid,
        occupancy,
        layers,
        values,
        changes.rank_limits,
        changes.calibrated,
        changes.coloured,
    )


def _holds(grid: GridSpec, smaller: GridSpec) -> bool:
    """Whether a grid holds all cells of another one of its cell size."""
    low, high = np.array(grid.origin_cell), np.add(grid.origin_cell, grid.shape)
    first, last = np.array(smaller.origin_cell), np.add(smaller.origin_cell, smaller.shape)
    inside = bool((low <= first).all() and (last <= high).all()) or 0 in smaller.shape
    return inside and grid.cell_size_m == smaller.cell_size_m


# Cells counted from the origin of the map frame: they mean the same place in every window.
WorldCells: TypeAlias = frozenset[tuple[int, int]]

# Unknown cells kept around the window, so that its rim can be a frontier, and a way lead around it.
BORDER_CELLS = 10

# The robot sees 10 m far, so it is in the map or near it. Further out its pose is wrong, and the
# window around both would fill the memory.
MAX_OUTSIDE_M = 50.0


PlanningView: TypeAlias = SearchView | AssembledView


@dataclass(frozen=True, slots=True)
class MapView:
    """The layers of a ``SearchView`` as masks, all (nx, ny) on ``grid``.

    occupancy uint8, values of ``Occupancy``; observed O, explored E bool; assumed
    bool: counts as free, but no camera saw it; floor_seen bool: the camera saw the floor there
    once, whatever stands there now; drops bool: occupied, because there is no floor;
    similarity float32 in [0, 1], NaN where not observed: the score, or for an encoder without
    calibration the place among the map's top tenth; margin float32: the score less that of the
    best name that competes with the object, infinity where none does, NaN where not observed;
    guidance float32 in [0, 1]: rank of the cell's cosine, NaN where not observed; scores float32 in
    [0, 1], NaN where not observed: of an encoder without calibration, None of others; likeness
    float32 in [0, 1]: of the cell's colour to the object's, NaN where it is not known, None where
    no colour is asked for.
    """

    grid: GridSpec
    occupancy: U8
    observed: Bool
    explored: Bool
    assumed: Bool
    floor_seen: Bool
    drops: Bool
    similarity: F32
    margin: F32
    guidance: F32
    scores: F32 | None = None
    likeness: F32 | None = None

    @property
    def promise(self) -> F32:
        """By which goals are chosen (nx, ny), NaN where not observed: the similarity.

        Without calibration it is the geometric mean of similarity and score: some cell is always
        the best of the map, though nothing on it is like the object.
        """
        if self.scores is None:
            return self.similarity
        promise: F32 = np.sqrt(np.maximum(self.scores, 0) * self.similarity)
        return promise

    @property
    def cell_area_m2(self) -> float:
        """Area of one cell in square metres."""
        return self.grid.cell_size_m**2

    def world_cells(self, cells: I64) -> WorldCells:
        """World cells of grid indices (K, 2)."""
        world = np.asarray(cells) + np.asarray(self.grid.origin_cell)
        return frozenset(map(tuple, world.tolist()))

    def indices_of(self, world_cells: WorldCells) -> I64:
        """Grid indices (K, 2) of world cells, without those outside the grid."""
        cells = np.array(sorted(world_cells), np.int64).reshape(-1, 2)
        cells = cells - np.asarray(self.grid.origin_cell)
        inside: I64 = cells[self.grid.contains(cells)]
        return inside


def known_area_m2(view: PlanningView) -> float:
    """Known area in square metres."""
    known = int(np.count_nonzero(view.occupancy != Occupancy.UNKNOWN))
    return known * view.grid.cell_size_m**2


def outside_reason(view: PlanningView, robot_xy: tuple[float, float]) -> str:
    """Why a view cannot be used with a robot at this place, metres; empty if it can."""
    if view.grid.shape == (0, 0):
        return ""
    x_min, y_min, x_max, y_max = view.grid.bounds_m
    x, y = robot_xy
    outside_m = max(x_min - x, x - x_max, y_min - y, y - y_max)
    if outside_m <= MAX_OUTSIDE_M:
        return ""
    return (
        f"the robot's pose is {outside_m:.0f} m outside the map; the limit is "
        f"{MAX_OUTSIDE_M:g} m: correct the localisation or clear the map"
    )


def map_view_around(view: PlanningView, robot_xy: F64, window_xy: F64 | None = None) -> MapView:
    """The known part of the view, cropped or grown so that the robot (2,) metres is inside.

    window_xy (2, 2): lowest and highest x and y, metres, outside of which nothing is needed.
    Maps come in tiles with many unknown cells; planning time depends on the known area only.
    """
    robot = view.grid.cells(robot_xy)
    box = _known_box(view, robot)
    if window_xy is not None:
        low, high = view.grid.cells(window_xy)
        first = np.maximum(box[0], low)
        box = np.stack([first, np.maximum(first, np.minimum(box[1], high + 1))])
    lower = np.minimum(box[0], robot) - BORDER_CELLS
    upper = np.maximum(box[1], robot + 1) + BORDER_CELLS
    grid = _grid_of(view.grid, lower, upper - lower)
    part = _cropped(view, box)

    def layer(of: NDArray, fill: float) -> NDArray:
        known = of.shape == part.grid.shape
        return onto(grid, part.grid, of, fill) if known else np.full(grid.shape, fill, of.dtype)

    layers, similarity = layer(part.layers, 0), layer(part.similarity, np.nan)
    margin = np.full(grid.shape, np.inf, np.float32)
    if part.rival.shape == part.grid.shape:
        rival = layer(np.nan_to_num(part.rival, nan=-np.inf), np.nan)
        margin = np.where(np.isnan(rival), margin, similarity - rival)
    ranks = layer(part.guidance, 0)
    guidance = np.where(ranks > 0, (ranks - np.float32(1.0)) / 254, np.nan).astype(np.float32)
    return MapView(
        grid=grid,
        occupancy=layer(part.occupancy, Occupancy.UNKNOWN),
        observed=(layers & Layer.OBSERVED) > 0,
        explored=(layers & Layer.EXPLORED) > 0,
        assumed=(layers & Layer.ASSUMED) > 0,
        floor_seen=(layers & Layer.FLOOR_SEEN) > 0,
        drops=(layers & Layer.DROP) > 0,
        similarity=similarity if part.calibrated else by_rank(guidance),
        margin=margin,
        guidance=guidance,
        scores=None if part.calibrated else similarity,
        likeness=layer(part.likeness, np.nan) if part.likeness.size else None,
    )


def _grid_of(grid: GridSpec, first: I64, shape: I64) -> GridSpec:
    """The grid of ``shape`` (2,) cells whose first one has the index ``first`` (2,) in ``grid``."""
    ix, iy = (int(index) for index in first + np.asarray(grid.origin_cell))
    nx, ny = (int(length) for length in shape)
    return GridSpec(grid.cell_size_m, (ix, iy), (nx, ny))


def _cropped(view: PlanningView, box: I64) -> SearchView:
    """The part of a view in a box (2, 2) of indices inside of it: first and one past the last."""
    (x0, y0), (x1, y1) = box.tolist()
    grid, part = _grid_of(view.grid, box[0], box[1] - box[0]), np.s_[..., x0:x1, y0:y1]
    occupancy, layers = view.occupancy[part], view.layers[part]
    if isinstance(view, AssembledView):
        values = view.values[part]
        return replace(view, grid=grid, occupancy=occupancy, layers=layers, values=values).whole()
    scores = {
        name: layer[part]
        for name in ("similarity", "rival", "guidance", "likeness")
        if (layer := getattr(view, name)).shape == view.grid.shape
    }
    return replace(view, grid=grid, occupancy=occupancy, layers=layers, **scores)


def _known_box(view: PlanningView, robot: I64) -> I64:
    """(2, 2): first and one-past-last known index on both axes; empty at the robot if none is."""
    known = (view.occupancy != Occupancy.UNKNOWN) | (view.layers > 0)
    if not known.any():
        return np.stack([robot, robot])
    box = np.zeros((2, 2), np.int64)
    for axis in (0, 1):
        filled = np.flatnonzero(known.any(axis=1 - axis))
        box[:, axis] = filled[0], filled[-1] + 1
    return box
