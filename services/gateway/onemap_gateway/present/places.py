"""Rooms and places as clients get them."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from onemap.place_replies import MapPlace, PlaceListReply
from onemap_gateway.present.replies import reply_of
from onemap_shared.geometry import I64
from onemap_shared.grid import GridSpec
from onemap_shared.messages import NO_ROOM, MapPlaces, PlaceKind, polygon_area_m2

STRAIGHT = 0.6  # of a cell: steps of a slanted wall go, a single cell stays a square


def place_list(message: MapPlaces) -> PlaceListReply:
    """The places and the rooms without a name, with their outlines as the map is now."""
    rooms = _rooms(message)
    places = []
    for place, number in zip(message.places, message.rooms, strict=True):
        shape: dict[str, Any] = rooms.get(number, {"outlines_m": (), "area_m2": 0.0})
        if place.corners_m:
            area_m2 = polygon_area_m2(place.corners_m)
            shape = {"outlines_m": (place.corners_m,), "area_m2": area_m2}
        places.append(reply_of(MapPlace, place, **{**shape, "inside_m": place.inside_m}))
    unnamed = [rooms[number] for number in rooms if number not in message.rooms]
    places += [MapPlace(name="", kind=PlaceKind.ROOM.value, **room) for room in unnamed]
    return reply_of(PlaceListReply, message, places=tuple(places))


def _rooms(message: MapPlaces) -> dict[int, dict[str, Any]]:
    """The members of a place that tell of the room, by its id."""
    cells = np.argwhere(message.ids != NO_ROOM)
    owners = message.ids[tuple(cells.T)]
    present, counts = np.unique(owners, return_counts=True)
    parts = np.split(cells[np.argsort(owners, kind="stable")], np.cumsum(counts)[:-1])
    pairs = zip(present.tolist(), parts, strict=False)
    return {room: {"room": room, **_shape(part, message.grid)} for room, part in pairs}


def _shape(cells: I64, grid: GridSpec) -> dict[str, Any]:
    """Area, outlines and the innermost point of the room with these cells (K, 2)."""
    low = cells.min(axis=0)
    padded = np.zeros(cells.max(axis=0) - low + 3, np.uint8)
    padded[tuple((cells - low + 1).T)] = 1
    depth = cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    inside = np.array(np.unravel_index(np.argmax(depth), depth.shape)) + low - 1
    # contours go through the corners of cells: [i, j] is the upper right one of padded cell [i, j]
    corners = cv2.dilate(padded, np.ones((2, 2), np.uint8), anchor=(0, 0))
    found, _ = cv2.findContours(corners, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    outlines = [cv2.approxPolyDP(part, STRAIGHT, closed=True)[:, 0, ::-1] for part in found]
    return {
        "area_m2": len(cells) * grid.cell_size_m**2,
        "inside_m": grid.centres(inside).tolist(),
        "outlines_m": tuple(
            ((outline + low + grid.origin_cell) * grid.cell_size_m).tolist()
            for outline in sorted(outlines, key=cv2.contourArea, reverse=True)
        ),
    }
