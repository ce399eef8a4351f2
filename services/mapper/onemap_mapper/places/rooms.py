"""Rooms: the floor cut where walls leave gaps as wide as doors and passages.

A wall is a straight run of tall occupied cells along x or y. Where one ends and, in its line, the
next tall cell is as near as the other side of a door, the gap is a doorway; what remains connected
is a room. Furniture that one can look over belongs to the room in which it stands.
"""
# Talks: threads ask for the rooms of one map.

from __future__ import annotations

import threading
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from onemap_shared.geometry import I32, I64, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import NO_ROOM, MapRooms, Occupancy, RoomChange, SearchView

WALL_M = 0.8  # a shorter straight run is the side of a cupboard
CROSSING_M = 0.5  # a run that meets this much of a wall across it ends there, not at a door
DOOR_M = (0.5, 1.7)  # a gap in a wall: narrower ones were not seen, wider ones are rooms
MIN_ROOM_M2 = 2.0  # less is a niche beside a cupboard and belongs to its neighbour
EXACT_DEG = 1.0  # a wall of 6 m then leaves its row of cells by one
THIN = 0.25  # of a cell: a turned wall of one cell is spread over two beside each other
PART = 0.25  # of a room that went elsewhere: less is a doorway that was cut differently
WALL_TOP_DM = 12  # seen up to there, a thing parts rooms; from 2 m a camera sees 1.7 m high


@dataclass(frozen=True, slots=True)
class Rooms:
    """``ids`` over ``grid``: of the room of every free cell, or NO_ROOM; ``next_id`` is free."""

    grid: GridSpec
    ids: I32
    next_id: int
    changes: tuple[RoomChange, ...] = ()

    @property
    def present(self) -> frozenset[int]:
        """The ids of all rooms."""
        return frozenset(np.unique(self.ids[self.ids != NO_ROOM]).tolist())

    def over(self, grid: GridSpec) -> I32:
        """The ids over another grid of the same cells, without those that lie outside."""
        cells = np.argwhere(self.ids != NO_ROOM)
        moved = cells + np.subtract(self.grid.origin_cell, grid.origin_cell)
        inside = ((moved >= 0) & (moved < grid.shape)).all(axis=1)
        ids = np.full(grid.shape, NO_ROOM, np.int32)
        ids[tuple(moved[inside].T)] = self.ids[tuple(cells[inside].T)]
        return ids


class RoomKeeper:
    """The rooms of one map, cut when they are asked for and the map changed since.

    It may be asked by several threads: ids are given by one of them at a time.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._rooms: Rooms | None = None
        self._reply: MapRooms | None = None

    def reply(self, view: SearchView) -> MapRooms:
        """The rooms of the map as it is now."""
        with self._lock:
            since = -1 if self._reply is None else self._reply.revision
            if self._reply is None or since < view.revision:
                self._rooms = found = rooms_of(view, self._rooms)
                self._reply = MapRooms(view.revision, since, found.grid, found.ids, found.changes)
            return self._reply


def rooms_of(view: SearchView, previous: Rooms | None = None) -> Rooms:
    """The rooms of a map, whose walls are told from furniture by their height."""
    occupied = view.occupancy == Occupancy.OCCUPIED
    low = occupied & (view.tops_dm > 0) & (view.tops_dm < WALL_TOP_DM)
    return rooms(view.occupancy == Occupancy.FREE, low, occupied & ~low, view.grid, previous)


def rooms(
    free: Bool, low: Bool, walls: Bool, grid: GridSpec, previous: Rooms | None = None
) -> Rooms:
    """The rooms of a map over ``grid``.

    free: floor that a robot can use; low: occupied cells that one can look over; walls: the other
    occupied ones. ``previous``: the rooms before; a room keeps the id of the one with which it
    shares most cells.
    """
    cell_size_m = grid.cell_size_m
    doors = doorways(walls, cell_size_m)
    inside, count = ndimage.label((free | low) & ~walls & ~doors)
    sizes = np.bincount(inside.ravel(), minlength=count + 1)
    small = sizes * cell_size_m**2 < MIN_ROOM_M2
    small[0] = True
    labels = np.where(small[inside], 0, inside)
    if labels.any():  # doorways and niches belong to what is nearest
        nearest = ndimage.distance_transform_edt(
            labels == 0, return_distances=False, return_indices=True
        )
        labels = labels[tuple(nearest)]
    labels[~free] = 0
    return _identified(labels, grid, previous)


def doorways(walls: Bool, cell_size_m: float) -> Bool:
    """Mask (nx, ny) of the gaps in walls that are doors or passages."""
    angle_deg = _angle_deg(walls)
    turned = _turned(walls, angle_deg)
    limits = round(DOOR_M[0] / cell_size_m), round(DOOR_M[1] / cell_size_m)
    gaps = _gaps(turned, _ends(turned, cell_size_m), limits)
    gaps |= _gaps(turned.T, _ends(turned.T, cell_size_m), limits).T
    back = _turned(gaps, -angle_deg)
    (x, y), (nx, ny) = np.subtract(back.shape, walls.shape) // 2, walls.shape
    return back[x : x + nx, y : y + ny]


def _angle_deg(walls: Bool) -> float:
    """How far the walls are turned from x and y, from -45 to 45 degrees, by their gradients."""
    image = walls.astype(np.float32)
    gradient = ndimage.gaussian_filter(image, 1, order=(0, 1)) + 1j * ndimage.gaussian_filter(
        image, 1, order=(1, 0)
    )
    strength = np.abs(gradient)
    return float(np.rad2deg(np.angle((strength**2 * np.exp(4j * np.angle(gradient))).sum()) / 4))


def _turned(mask: Bool, angle_deg: float) -> Bool:
    """The mask in a frame turned by an angle, large enough for all of it."""
    if abs(angle_deg) < EXACT_DEG:
        return mask
    turned = ndimage.rotate(mask.astype(np.float32), angle_deg, order=1)
    return np.asarray(turned > THIN)


def _ends(walls: Bool, cell_size_m: float) -> Bool:
    """Cells of straight runs along the rows, without those that another run crosses."""
    along, across = (round(length / cell_size_m) for length in (WALL_M, CROSSING_M))
    return np.asarray(
        ndimage.binary_opening(walls, np.ones((1, along)))
        & ~ndimage.binary_opening(walls, np.ones((across, 1)))
    )


def _gaps(walls: Bool, ends: Bool, limits: tuple[int, int]) -> Bool:
    """Gaps of ``limits`` cells in the rows of an image, beside at least one of ``ends``."""
    gaps = np.zeros_like(walls)
    for row in np.flatnonzero(ends.any(axis=1)):
        cells = np.flatnonzero(walls[row])
        lengths = np.diff(cells) - 1
        for at in np.flatnonzero((lengths >= limits[0]) & (lengths <= limits[1])):
            begin, end = cells[at], cells[at + 1]
            if ends[row, begin] or ends[row, end]:
                gaps[row, begin + 1 : end] = True
    return gaps


def _identified(labels: I32, grid: GridSpec, previous: Rooms | None) -> Rooms:
    """Labels, from 1 on, as rooms: with the ids of those with which they share most cells."""
    sizes = np.bincount(labels.ravel(), minlength=1)
    sizes[0] = 0
    present = np.flatnonzero(sizes)
    ids = np.full(len(sizes), NO_ROOM, np.int32)
    changes: tuple[RoomChange, ...] = ()
    next_id = 0 if previous is None else previous.next_id
    shared = np.zeros((len(sizes), next_id), np.int64)
    if previous is not None:
        ids_before = previous.over(grid)
        both = (labels > 0) & (ids_before != NO_ROOM)
        np.add.at(shared, (labels[both], ids_before[both]), 1)
        for flat in np.argsort(-shared, axis=None, kind="stable")[: np.count_nonzero(shared)]:
            label, before = np.unravel_index(flat, shared.shape)
            if ids[label] == NO_ROOM and before not in ids:
                ids[label] = before
    new = present[ids[present] == NO_ROOM]
    ids[new] = next_id + np.arange(len(new))
    if previous is not None:
        changes = _changes(shared, ids)
    return Rooms(grid, ids[labels], next_id + len(new), changes)


def _changes(shared: I64, ids: I32) -> tuple[RoomChange, ...]:
    """Which rooms split and joined: of a room, a part counts from a quarter of it on."""
    parts = shared >= np.maximum(PART * shared.sum(axis=0), 1)
    splits = [
        RoomChange((int(before),), tuple(ids[parts[:, before]].tolist()))
        for before in np.flatnonzero(parts.sum(axis=0) > 1)
    ]
    joins = [
        RoomChange(tuple(np.flatnonzero(parts[label]).tolist()), (int(ids[label]),))
        for label in np.flatnonzero(parts.sum(axis=1) > 1)
    ]
    return (*splits, *joins)
