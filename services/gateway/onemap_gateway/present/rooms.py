"""Rooms as clients get them: areas and outlines of labelled cells."""

from __future__ import annotations

import cv2
import numpy as np

from onemap.place_replies import MapRoom, RoomListReply
from onemap_gateway.present.replies import reply_of
from onemap_shared.geometry import I32, I64
from onemap_shared.grid import GridSpec
from onemap_shared.messages import NO_ROOM, MapRooms

STRAIGHT = 0.6  # of a cell: steps of a slanted wall go, a single cell stays a square


def room_list(message: MapRooms) -> RoomListReply:
    """The rooms with what split and joined."""
    since = None if message.since < 0 else message.since
    rooms = map_rooms(message.ids, message.grid)
    return reply_of(RoomListReply, message, rooms=rooms, since=since)


def map_rooms(ids: I32, grid: GridSpec) -> tuple[MapRoom, ...]:
    """The rooms whose ids, or NO_ROOM, the cells (nx, ny) of ``grid`` have."""
    cells = np.argwhere(ids != NO_ROOM)
    owners = ids[tuple(cells.T)]
    present, counts = np.unique(owners, return_counts=True)
    parts = np.split(cells[np.argsort(owners, kind="stable")], np.cumsum(counts)[:-1])
    return tuple(
        _room(room, part, grid) for room, part in zip(present.tolist(), parts, strict=False)
    )


def _room(room: int, cells: I64, grid: GridSpec) -> MapRoom:
    """The room with these cells (K, 2)."""
    low = cells.min(axis=0)
    padded = np.zeros(cells.max(axis=0) - low + 3, np.uint8)
    padded[tuple((cells - low + 1).T)] = 1
    depth = cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    inside = np.array(np.unravel_index(np.argmax(depth), depth.shape)) + low - 1
    # contours go through the corners of cells: [i, j] is the upper right one of padded cell [i, j]
    corners = cv2.dilate(padded, np.ones((2, 2), np.uint8), anchor=(0, 0))
    found, _ = cv2.findContours(corners, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    outlines = [cv2.approxPolyDP(part, STRAIGHT, closed=True)[:, 0, ::-1] for part in found]
    return MapRoom(
        id=room,
        area_m2=len(cells) * grid.cell_size_m**2,
        inside_m=grid.centres(inside).tolist(),
        outlines_m=tuple(
            ((outline + low + grid.origin_cell) * grid.cell_size_m).tolist()
            for outline in sorted(outlines, key=cv2.contourArea, reverse=True)
        ),
    )
