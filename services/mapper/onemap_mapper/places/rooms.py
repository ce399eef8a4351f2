"""Rooms: the floor cut where walls leave gaps as wide as doors and passages.

A wall is a straight run of tall occupied cells along x or y. Where one ends and, in its line, the
next tall cell is as near as the other side of a door, the gap is a doorway; what remains connected
is a room. Furniture that one can look over belongs to the room in which it stands.

While the map is young, the other side of a door is seen before its walls are, and counts to the
room on this side. So a room has parts: cut wherever what was not seen may be a wall with a door in
it. Two cells of one part are in one room, whatever is seen later.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from onemap_shared.geometry import I32, I64, Bool
from onemap_shared.grid import GridSpec, onto
from onemap_shared.messages import (
    MAX_ROOM_CHANGES,
    NO_ROOM,
    Occupancy,
    RoomChange,
    SearchView,
)
from onemap_shared.messages.checks import without
from onemap_shared.places import SPECK_M

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
    """``ids`` over ``grid``: of the room of every free cell, or NO_ROOM; ``next_id`` is free.

    revision: of the map; changes: the latest, the newest last; parts: as of ``parts_of``.
    """

    revision: int
    grid: GridSpec
    ids: I32
    next_id: int = 0
    changes: tuple[RoomChange, ...] = ()
    parts: I32 = without(np.int32, 0, 0)

    @property
    def present(self) -> frozenset[int]:
        """The ids of all rooms."""
        return frozenset(np.unique(self.ids[self.ids != NO_ROOM]).tolist())


class RoomKeeper:
    """The rooms of one map, cut when they are asked for and the map changed since.

    It may be asked by several threads: under ``lock``, ids are given by one of them at a time.
    """

    def __init__(self, lock: AbstractContextManager[object]) -> None:
        self._lock = lock
        self._rooms: Rooms | None = None

    def of(self, view: SearchView) -> Rooms:
        """The rooms of the map as it is now."""
        with self._lock:
            if self._rooms is None or self._rooms.revision < view.revision:
                self._rooms = rooms_of(view, self._rooms)
            return self._rooms


def rooms_of(view: SearchView, previous: Rooms | None = None) -> Rooms:
    """The rooms of a map, whose walls are told from furniture by their height."""
    occupied = view.occupancy == Occupancy.OCCUPIED
    low = occupied & (view.tops_dm > 0) & (view.tops_dm < WALL_TOP_DM)
    free, walls, size_m = view.occupancy == Occupancy.FREE, occupied & ~low, view.grid.cell_size_m
    labels = labelled(free, low, walls, size_m)
    found = identified(labels, view.grid, previous, view.revision)
    return replace(found, parts=parts_of(free, low, walls, size_m))


def labelled(free: Bool, low: Bool, walls: Bool, cell_size_m: float) -> I32:
    """Number (nx, ny) of the room of each free cell, from 1 on; 0 elsewhere.

    free: floor that a robot can use; low: occupied cells that one can look over; walls: the other
    occupied ones.
    """
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
    return labels


def parts_of(free: Bool, low: Bool, walls: Bool, cell_size_m: float) -> I32:
    """Number (nx, ny) of the part of a room that each free cell is in; NO_ROOM elsewhere, and where
    a doorway may be.

    Masks as of ``labelled``; what is none of them, and what lies beyond, was not seen.
    """
    beyond = round(WALL_M / cell_size_m)
    free, low, walls = (np.pad(mask, beyond) for mask in (free, low, walls))
    speck = round(SPECK_M / cell_size_m)
    unseen = ndimage.binary_opening(~(free | low | walls), np.ones((speck, speck)))
    unseen |= low & ndimage.binary_dilation(unseen)  # of a wall, perhaps: from near it looks low
    doors = doorways(walls, cell_size_m, unseen)
    numbers, _ = ndimage.label((free | low) & ~walls & ~unseen & ~doors)
    parts = np.where(free & (numbers > 0), numbers, NO_ROOM).astype(np.int32)
    return parts[beyond:-beyond, beyond:-beyond]


def doorways(walls: Bool, cell_size_m: float, unseen: Bool | None = None) -> Bool:
    """Mask (nx, ny) of the gaps in walls that are doors or passages.

    unseen: where walls may be; with it, gaps that may be doors, of which only a part may be seen.
    """
    angle_deg = _angle_deg(walls)
    known = _turned(walls, angle_deg)
    turned = known if unseen is None else known | _turned(unseen, angle_deg)
    least, most = (round(length / cell_size_m) for length in DOOR_M)
    limits = least if unseen is None else 1, most
    gaps = _gaps(turned, _ends(turned, known, cell_size_m), limits)
    gaps |= _gaps(turned.T, _ends(turned.T, known.T, cell_size_m), limits).T
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


def _ends(walls: Bool, known: Bool, cell_size_m: float) -> Bool:
    """Cells of straight runs along the rows, without those that a run of known walls crosses."""
    along, across = (round(length / cell_size_m) for length in (WALL_M, CROSSING_M))
    return np.asarray(
        ndimage.binary_opening(walls, np.ones((1, along)))
        & ~ndimage.binary_opening(known, np.ones((across, 1)))
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


def identified(
    labels: I32, grid: GridSpec, previous: Rooms | None = None, revision: int = 0
) -> Rooms:
    """Labels as of ``labelled`` as rooms: each keeps the id of the one before with which it shares
    most cells."""
    before = previous or Rooms(revision, grid, np.full(grid.shape, NO_ROOM, np.int32))
    present = np.setdiff1d(labels, 0)
    ids = np.full(labels.max(initial=0) + 1, NO_ROOM, np.int32)
    shared = np.zeros((len(ids), before.next_id), np.int64)
    ids_before = onto(grid, before.grid, before.ids, NO_ROOM)
    both = (labels > 0) & (ids_before != NO_ROOM)
    np.add.at(shared, (labels[both], ids_before[both]), 1)
    for flat in np.argsort(-shared, axis=None, kind="stable")[: np.count_nonzero(shared)]:
        label, room = np.unravel_index(flat, shared.shape)
        if ids[label] == NO_ROOM and room not in ids:
            ids[label] = room
    new = present[ids[present] == NO_ROOM]
    ids[new] = before.next_id + np.arange(len(new))
    changes = (*before.changes, *_changes(shared, ids, revision))[-MAX_ROOM_CHANGES:]
    return Rooms(revision, grid, ids[labels], before.next_id + len(new), changes)


def _changes(shared: I64, ids: I32, revision: int) -> Iterator[RoomChange]:
    """Which rooms split and joined: of a room, a part counts from a quarter of it on."""
    parts = shared >= np.maximum(PART * shared.sum(axis=0), 1)
    for room in np.flatnonzero(parts.sum(axis=0) > 1):
        yield RoomChange(revision, (int(room),), tuple(ids[parts[:, room]].tolist()))
    for label in np.flatnonzero(parts.sum(axis=1) > 1):
        before = tuple(np.flatnonzero(parts[label]).tolist())
        yield RoomChange(revision, before, (int(ids[label]),))
