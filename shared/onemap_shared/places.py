"""Which room holds a point; which cells a place covers, of its room or in its polygon; zones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F64, I32, I64, Bool
from onemap_shared.grid import GridSpec, onto
from onemap_shared.messages import NO_ROOM, MapPlaces, Place, PlaceKind

NEAR_M = 1.0  # a point in furniture, or in what was put there later, is in the room beside it
SPECK_M = 0.3  # what was not seen and is narrower hides no wall, and no way
BESIDE_M = 0.25  # beside a thing: what the map blurs, two cells
NAMED_M = 0.3  # from the point that names a room to the part of it that it names
NOWHERE = MapPlaces(0, -1, (), (), GridSpec(0.1, (0, 0), (0, 0)), np.zeros((0, 0), np.int32))


def room_at(ids: I32, grid: GridSpec, point_m: Sequence[float], within_m: float = NEAR_M) -> int:
    """The room of the free cell nearest to x, y within metres; NO_ROOM if there is none.

    ids: (nx, ny) of the room of every free cell of ``grid``, NO_ROOM elsewhere.
    """
    reach = round(within_m / grid.cell_size_m)
    cell = grid.cells(np.array(point_m, np.float64))
    (left, bottom), (right, top) = np.clip([cell - reach, cell + reach + 1], 0, grid.shape)
    near = ids[left:right, bottom:top]
    cells = np.argwhere(near != NO_ROOM)
    if not len(cells):
        return NO_ROOM
    distances = np.linalg.norm(cells + (left, bottom) - cell, axis=1)
    nearest = int(distances.argmin())
    return int(near[tuple(cells[nearest])]) if distances[nearest] <= reach else NO_ROOM


def near_cells(cells: I64, grid: GridSpec) -> I64:
    """The cells (K, n, 2) within ``BESIDE_M`` of each of (K, 2), also beyond the grid."""
    reach = int(BESIDE_M / grid.cell_size_m)
    steps = np.argwhere(np.ones((2 * reach + 1, 2 * reach + 1), bool)) - reach
    near: I64 = cells[:, None] + steps[np.hypot(*steps.T) <= reach]
    return near


def rooms_at(places: MapPlaces, grid: GridSpec, cells: I64) -> I32:
    """The room of the floor at cells (..., 2) of ``grid``; NO_ROOM where none is."""
    if places.ids.size == 0:
        return np.full(cells.shape[:-1], NO_ROOM, np.int32)
    there = cells + np.subtract(grid.origin_cell, places.grid.origin_cell)
    x, y = np.moveaxis(np.clip(there, 0, np.array(places.ids.shape) - 1), -1, 0)
    rooms: I32 = np.where(places.grid.contains(there), places.ids[x, y], np.int32(NO_ROOM))
    return rooms


def room_beside(places: MapPlaces, grid: GridSpec, cells: I64) -> int:
    """The room of a thing of cells (K, 2): of most of the floor beside it, since its back may be
    nearer to the room behind the wall; else of the nearest floor; NO_ROOM without any."""
    if len(cells) == 0:
        return NO_ROOM
    rooms = rooms_at(places, grid, near_cells(cells, grid))
    found, counts = np.unique(rooms[rooms != NO_ROOM], return_counts=True)
    if len(found):
        return int(found[counts.argmax()])
    return room_at(places.ids, places.grid, grid.centres(cells).mean(axis=0))


def place_of(places: MapPlaces, grid: GridSpec, cells: I64) -> Place | None:
    """The place with a name that a thing of cells (K, 2) is in: a polygon that holds its middle,
    else its room; None without any.

    Zones that a robot keeps out of say where nothing is to be, not where something is.
    """
    if len(cells) == 0:
        return None
    x_m, y_m = map(float, grid.centres(cells).mean(axis=0))
    room = room_beside(places, grid, cells)
    cell = GridSpec.covering(places.grid.cell_size_m, (x_m, y_m), (x_m, y_m))
    found = None
    for place, its_room in zip(places.places, places.rooms, strict=True):
        if place.kind is PlaceKind.ROOM and place.corners_m:
            if polygon_mask(np.array(place.corners_m, np.float64), cell).any():
                return place
        elif place.kind is PlaceKind.ROOM and NO_ROOM != its_room == room and found is None:
            found = place
    return found


def place_mask(
    places: MapPlaces, name: str, grid: GridSpec, *, in_part: bool = False, settled: bool = False
) -> Bool:
    """Cells (nx, ny) of ``grid`` that a place covers, a polygon's also where nothing is known.

    None if the map has no place of this name, or does not show its room. in_part: as of
    ``polygon_mask``; settled: of a room only the part that holds the point by which it is named,
    which belongs to it whatever is seen later.
    """
    place, room = places.get(name) or (None, NO_ROOM)
    if place is not None and place.corners_m:
        return polygon_mask(np.array(place.corners_m, np.float64), grid, in_part=in_part)
    cells = (places.ids == room) & (room != NO_ROOM)
    if settled and place is not None:
        parts = places.parts if places.parts.size else np.full_like(places.ids, NO_ROOM)
        parts = np.where(cells, parts, np.int32(NO_ROOM))
        part = room_at(parts, places.grid, place.inside_m, NAMED_M)
        cells = (parts == part) & (part != NO_ROOM)
    return onto(grid, places.grid, cells)


def polygon_mask(corners_m: F64, grid: GridSpec, *, in_part: bool = False) -> Bool:
    """Cells (nx, ny) of ``grid`` whose centre lies in a polygon of corners (K, 2), metres.

    A point is inside if a ray from it crosses the edges an odd number of times. in_part: also those
    that an edge crosses, or passes at less than half a diagonal.
    """
    mask, cells = np.zeros(grid.shape, bool), grid.cells(corners_m)
    low = np.clip(cells.min(axis=0) - 1, 0, grid.shape)
    high = np.clip(cells.max(axis=0) + 2, 0, grid.shape)
    centres = grid.centres(np.moveaxis(np.indices(high - low), 0, -1) + low)
    x, y = np.moveaxis(centres, -1, 0)
    inside = mask[low[0] : high[0], low[1] : high[1]]
    near = np.zeros_like(inside)
    for start, end in zip(corners_m, np.roll(corners_m, -1, axis=0), strict=True):
        edge = end - start
        with np.errstate(divide="ignore", invalid="ignore"):
            crossed = x < start[0] + (y - start[1]) * edge[0] / edge[1]
        inside ^= ((start[1] > y) != (end[1] > y)) & crossed
        along = np.clip((centres - start) @ edge / max(float(edge @ edge), 1e-12), 0.0, 1.0)
        away_m = np.linalg.norm(centres - start - along[..., None] * edge, axis=-1)
        near |= away_m <= grid.cell_size_m * np.sqrt(0.5)
    if in_part:
        inside |= near
    return mask


@dataclass(frozen=True, slots=True)
class Zones:
    """Where the robot must not be: the keep-out zones among places, and those named to stay out of.

    What a polygon covers in part belongs to it: a zone may be narrower than a cell.
    """

    places: MapPlaces = NOWHERE
    stay_out: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all zones."""
        zones = (each.name for each in self.places.places if each.kind is PlaceKind.KEEP_OUT)
        return tuple(dict.fromkeys((*zones, *self.stay_out)))

    def mask(self, grid: GridSpec) -> Bool:
        """Cells (nx, ny) of a grid that a zone covers."""
        mask = np.zeros(grid.shape, bool)
        for name in self.names:
            mask |= place_mask(self.places, name, grid, in_part=True)
        return mask

    def at(self, xy: tuple[float, float], within_m: float, cell_size_m: float) -> str:
        """The name of a zone within about a distance of a point, metres; empty if there is none."""
        (x0, y0), (x1, y1) = np.subtract(xy, within_m).tolist(), np.add(xy, within_m).tolist()
        grid = GridSpec.covering(cell_size_m, (x0, y0), (x1, y1))
        masks = ((name, place_mask(self.places, name, grid, in_part=True)) for name in self.names)
        return next((name for name, mask in masks if mask.any()), "")

    def problem(self) -> str:
        """Why it is not known where a zone is; empty if it is known of all."""
        for name in self.names:
            place, room = self.places.get(name) or (None, NO_ROOM)
            if place is None:
                return f"there is no place {name!r} any more"
            if place.inside_m and room == NO_ROOM:
                x_m, y_m = place.inside_m
                return f"the map shows no room for {name!r} at ({x_m:.1f}, {y_m:.1f})"
        return ""


NO_ZONES = Zones()
