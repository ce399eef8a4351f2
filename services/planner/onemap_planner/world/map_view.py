"""Map view: the layers of the map for one object, on a window that contains the robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from onemap_shared.geometry import F32, F64, I64, U8, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Layer, Occupancy, SearchView

# Cells counted from the origin of the map frame: they mean the same place in every window.
WorldCells: TypeAlias = frozenset[tuple[int, int]]

BORDER_CELLS = 2  # unknown cells kept around the window, so that its rim can be a frontier

# The robot sees 10 m far, so it is in the map or near it. Further out its pose is wrong, and the
# window around both would fill the memory.
MAX_OUTSIDE_M = 50.0


class WindowedView(Protocol):
    """A view of which only the parts that are looked at become arrays, as ``AssembledView``."""

    @property
    def text(self) -> str:
        """As in ``SearchView``."""

    @property
    def stamp_ns(self) -> int:
        """As in ``SearchView``."""

    @property
    def grid(self) -> GridSpec:
        """Of the whole view."""

    @property
    def known_occupancy_cells(self) -> int:
        """Cells that are free or occupied."""

    def known_box(self) -> I64 | None:
        """First and one past the last index (2, 2) of the cells that anything is known of."""

    def cropped(self, low: I64, high: I64) -> SearchView:
        """The part from index ``low`` (2,) up to, without, ``high`` (2,)."""


PlanningView: TypeAlias = SearchView | WindowedView


@dataclass(frozen=True, slots=True)
class MapView:
    """The layers of a ``SearchView`` as masks, all (nx, ny) on ``grid``.

    occupancy uint8, values of ``Occupancy``; observed O, explored E, searched C bool; assumed
    bool: counts as free, but no camera saw it; floor_seen bool: the camera saw the floor there
    once, whatever stands there now;
    similarity float32 in [0, 1], NaN where not observed: the score, or for an encoder without
    calibration the place among the map's top tenth; margin float32: the score less that of the
    best name that competes with the object, infinity where none does, NaN where not observed;
    guidance float32 in [0, 1]: rank of the cell's cosine, NaN where not observed; calibrated:
    whether the score is a probability.
    """

    grid: GridSpec
    occupancy: U8
    observed: Bool
    explored: Bool
    searched: Bool
    assumed: Bool
    floor_seen: Bool
    similarity: F32
    margin: F32
    guidance: F32
    calibrated: bool = True

    @property
    def cell_area_m2(self) -> float:
        """Area of one cell in square metres."""
        return self.grid.cell_size_m**2

    def world_cells(self, cells: I64) -> WorldCells:
        """World cells of grid indices (K, 2)."""
        world = np.asarray(cells) + np.asarray(self.grid.origin_cell)
        return frozenset((int(ix), int(iy)) for ix, iy in world)

    def indices_of(self, world_cells: WorldCells) -> I64:
        """Grid indices (K, 2) of world cells, without those outside the grid."""
        cells = np.array(sorted(world_cells), np.int64).reshape(-1, 2)
        cells = cells - np.asarray(self.grid.origin_cell)
        inside: I64 = cells[self.grid.contains(cells)]
        return inside


def known_area_m2(view: PlanningView) -> float:
    """Known area in square metres."""
    if not isinstance(view, SearchView):
        return view.known_occupancy_cells * view.grid.cell_size_m**2
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
    source = _needed_box(view, robot, window_xy)
    lower = np.minimum(source[0], robot) - BORDER_CELLS
    upper = np.maximum(source[1], robot + 1) + BORDER_CELLS
    grid = _grid_of(view.grid, lower, upper - lower)
    inside = _slices(source - lower)
    part = _cropped(view, source)

    occupancy = np.full(grid.shape, Occupancy.UNKNOWN, np.uint8)
    occupancy[inside] = part.occupancy
    layers = np.zeros(grid.shape, np.uint8)
    layers[inside] = part.layers
    similarity = np.full(grid.shape, np.nan, np.float32)
    if part.similarity.shape == part.grid.shape:
        similarity[inside] = part.similarity
    margin = np.full(grid.shape, np.inf, np.float32)
    if part.rival.shape == part.grid.shape:
        margin[inside] = similarity[inside] - np.nan_to_num(part.rival, nan=-np.inf)
    guidance = np.full(grid.shape, np.nan, np.float32)
    if part.guidance.shape == part.grid.shape:
        guidance[inside] = _ranks(part.guidance)
    return MapView(
        grid=grid,
        occupancy=occupancy,
        observed=(layers & Layer.OBSERVED) > 0,
        explored=(layers & Layer.EXPLORED) > 0,
        searched=(layers & Layer.SEARCHED) > 0,
        assumed=(layers & Layer.ASSUMED) > 0,
        floor_seen=(layers & Layer.FLOOR_SEEN) > 0,
        similarity=similarity if part.calibrated else _top_tenth(guidance),
        margin=margin,
        guidance=guidance,
        calibrated=part.calibrated,
    )


def _needed_box(view: PlanningView, robot: I64, window_xy: F64 | None) -> I64:
    """(2, 2): first and one-past-last index of what is known, and inside of the window if any."""
    box = _known_box(view, robot)
    if window_xy is None:
        return box
    low, high = view.grid.cells(window_xy)
    first = np.maximum(box[0], low)
    needed: I64 = np.stack([first, np.maximum(first, np.minimum(box[1], high + 1))])
    return needed


def _grid_of(grid: GridSpec, first: I64, shape: I64) -> GridSpec:
    """The grid of ``shape`` (2,) cells whose first one has the index ``first`` (2,) in ``grid``."""
    ix, iy = (int(index) for index in first + np.asarray(grid.origin_cell))
    nx, ny = (int(length) for length in shape)
    return GridSpec(grid.cell_size_m, (ix, iy), (nx, ny))


def _slices(box: I64) -> tuple[slice, ...]:
    """The index expression of a box (2, 2): first and one-past-last index."""
    return tuple(slice(int(first), int(end)) for first, end in zip(*box, strict=True))


def _ranks(guidance: U8) -> F32:
    """Ranks in [0, 1] from those of a message, 1 to 255; 0, not observed, becomes NaN."""
    ranks: F32 = np.where(guidance > 0, (guidance - np.float32(1.0)) / 254, np.nan)
    return ranks


def _top_tenth(guidance: F32) -> F32:
    """Similarity (nx, ny) by rank: 0 up to the 90th percentile of the map, 1 for its best cell.

    The cosines of an encoder without calibration lie close together, each encoder's elsewhere:
    no threshold on them holds for two encoders, but a rank does.
    """
    similarity: F32 = np.clip((guidance - np.float32(0.9)) / np.float32(0.1), 0.0, 1.0)
    return similarity


def _cropped(view: PlanningView, box: I64) -> SearchView:
    """The part of a view in a box (2, 2) of indices inside of it: first and one past the last."""
    if not isinstance(view, SearchView):
        return view.cropped(*box)
    out_of = _slices(box)
    grid = _grid_of(view.grid, box[0], box[1] - box[0])

    def part(layer: NDArray) -> NDArray:
        return layer[out_of] if layer.shape == view.grid.shape else layer

    return replace(
        view,
        grid=grid,
        occupancy=part(view.occupancy),
        layers=part(view.layers),
        similarity=part(view.similarity),
        rival=part(view.rival),
        guidance=part(view.guidance),
    )


def _known_box(view: PlanningView, robot: I64) -> I64:
    """(2, 2): first and one-past-last known index on both axes; empty at the robot if none is."""
    if not isinstance(view, SearchView):
        box = view.known_box()
        return np.stack([robot, robot]) if box is None else box
    known = (view.occupancy != Occupancy.UNKNOWN) | (view.layers > 0)
    if not known.any():
        return np.stack([robot, robot])
    box = np.zeros((2, 2), np.int64)
    for axis in (0, 1):
        filled = np.flatnonzero(known.any(axis=1 - axis))
        box[:, axis] = filled[0], filled[-1] + 1
    return box
