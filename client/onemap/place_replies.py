"""What a gateway replies about rooms and named places, in metres of the map frame."""

from __future__ import annotations

from pydantic import Field

from onemap.replies import MaybePoint, Point, Reply, Rounded


class MapPlace(Reply):
    """A part of the floor: a room, cut off at doors and narrow passages, or a named polygon."""

    name: str = Field(
        description="No other place has it, whatever its case; empty: a room without a name."
    )
    kind: str = Field(description="room, or keep_out: no robot enters it.")
    suggested: bool = Field(
        default=False, description="Named by what was found there, not by a person."
    )
    room: int | None = Field(
        default=None,
        description="Id of the room, which stays while the map grows; another map begins at 0. "
        "null: a polygon, or no room is known there.",
    )
    inside_m: MaybePoint = Field(
        default=None, description="x, y in the room, which may grow around it; null: a polygon."
    )
    corners_m: tuple[Point, ...] = Field(default=(), description="The polygon; empty: a room.")
    outlines_m: tuple[tuple[Point, ...], ...] = Field(
        description="The polygon, or each part of the room's floor as it is now, within a cell, "
        "the largest part first; holes are filled."
    )
    area_m2: Rounded = Field(description="Of the room's free floor, or of the polygon.")


class ChangedRooms(Reply):
    """A room that split into several, or several that joined."""

    revision: int = Field(description="Of the map in which it was noticed.")
    before: tuple[int, ...] = Field(description="The ids before.")
    after: tuple[int, ...] = Field(description="The ids now; a new one, or one of those before.")


class PlaceListReply(Reply):
    """Places in the order of their naming, then suggested names, then rooms without a name."""

    places: tuple[MapPlace, ...]
    revision: int = Field(description="Of the map whose rooms these are.")
    changes: tuple[ChangedRooms, ...] = Field(
        default=(), description="The latest splits and joins of rooms, the newest last."
    )
