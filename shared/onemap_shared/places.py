"""Which room holds a point; which cells a place covers: of its room, or in its polygon."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from onemap_shared.geometry import F64, I32, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import NO_ROOM, MapPlaces, PlaceKind
from onemap_shared.names import normalised

NEAR_M = 1.0  # a point in furniture, or in what was put there later, is in the room beside it


def room_at(ids: I32, grid: GridSpec, point_m: Sequence[float]) -> int:
    """The room of the free cell nearest to x, y within ``NEAR_M``; NO_ROOM if there is none.

    ids: (nx, ny) of the room of every free cell of ``grid``, NO_ROOM elsewhere.
    """
    reach = round(NEAR_M / grid.cell_size_m)
    cell = grid.cells(np.array(point_m, np.float64))
    (left, bottom), (right, top) = np.clip([cell - reach, cell + reach + 1], 0, grid.shape)
    near = ids[left:right, bottom:top]
    cells = np.argwhere(near != NO_ROOM)
    if not len(cells):
        return NO_ROOM
    distances = np.linalg.norm(cells + (left, bottom) - cell, axis=1)
    nearest = int(distances.argmin())
    return int(near[tuple(cells[nearest])]) if distances[nearest] <= reach else NO_ROOM


def zones_mask(places: MapPlaces, grid: GridSpec, stay_out: Iterable[str] = ()) -> Bool:
    """Cells (nx, ny) of ``grid`` that no robot enters: all keep-out zones, and these places.

    Also those that a polygon covers in part: a zone may be narrower than a cell. Raises KeyError if
    the map has no place of one of the names.
    """
    mask = np.zeros(grid.shape, bool)
    for name in zone_names(places, stay_out):
        mask |= place_mask(places, name, grid, in_part=True)
    return mask


def zone_names(places: MapPlaces, stay_out: Iterable[str] = ()) -> tuple[str, ...]:
    """The names of all keep-out zones, and these."""
    zones = (place.name for place in places.places if place.kind is PlaceKind.KEEP_OUT)
    return tuple(dict.fromkeys((*zones, *stay_out)))


def place_mask(places: MapPlaces, name: str, grid: GridSpec, *, in_part: bool = False) -> Bool:
    """Cells (nx, ny) of ``grid`` that a place covers, a polygon's also where nothing is known.

    in_part: also those of which a polygon covers a part. Raises KeyError if the map has no place of
    this name.
    """
    for place, room in zip(places.places, places.rooms, strict=True):
        if normalised(place.name) == normalised(name):
            if place.corners_m:
                corners_m = np.array(place.corners_m, np.float64)
                mask = polygon_mask(corners_m, grid)
                return mask | _outline(corners_m, grid) if in_part else mask
            return _room_mask(places, room, grid)
    raise KeyError(name)


def _room_mask(places: MapPlaces, room: int, grid: GridSpec) -> Bool:
    mask = np.zeros(grid.shape, bool)
    if room != NO_ROOM:
        cells = np.argwhere(places.ids == room)
        cells = cells + np.subtract(places.grid.origin_cell, grid.origin_cell)
        mask[tuple(cells[grid.contains(cells)].T)] = True
    return mask


def polygon_mask(corners_m: F64, grid: GridSpec) -> Bool:
    """Cells (nx, ny) of ``grid`` whose centre lies in a polygon of corners (K, 2), metres.

    A point is inside if a ray from it crosses the edges an odd number of times.
    """
    mask = np.zeros(grid.shape, bool)
    box, centres = _around(corners_m, grid)
    x, y = centres[..., 0], centres[..., 1]
    inside = mask[box]
    for (x0, y0), (x1, y1) in zip(corners_m, np.roll(corners_m, -1, axis=0), strict=True):
        between = (y0 > y) != (y1 > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            inside ^= between & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return mask


def _outline(corners_m: F64, grid: GridSpec) -> Bool:
    """Cells (nx, ny) of ``grid`` that the edges of a polygon of corners (K, 2), metres, cross.

    And those that they pass at less than half a diagonal.
    """
    mask = np.zeros(grid.shape, bool)
    box, centres = _around(corners_m, grid)
    near = mask[box]
    for start, end in zip(corners_m, np.roll(corners_m, -1, axis=0), strict=True):
        edge = end - start
        along = np.clip((centres - start) @ edge / max(float(edge @ edge), 1e-12), 0.0, 1.0)
        away_m = np.linalg.norm(centres - start - along[..., None] * edge, axis=-1)
        near |= away_m <= grid.cell_size_m * np.sqrt(0.5)
    return mask


def _around(corners_m: F64, grid: GridSpec) -> tuple[tuple[slice, slice], F64]:
    """The part of a grid around corners (K, 2), metres, and the centres (n, m, 2) of its cells."""
    cells = grid.cells(corners_m)
    low = np.clip(cells.min(axis=0) - 1, 0, grid.shape)
    high = np.clip(cells.max(axis=0) + 2, 0, grid.shape)
    box = np.stack(np.meshgrid(*map(np.arange, low, high), indexing="ij"), axis=-1)
    return (slice(low[0], high[0]), slice(low[1], high[1])), grid.centres(box)
