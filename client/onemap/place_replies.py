"""What a gateway replies about rooms and named places, in metres of the map frame."""

from __future__ import annotations

from pydantic import Field

from onemap.replies import MaybePoint, Point, Reply, Rounded


class MapRoom(Reply):
    """A part of the free floor, cut off at doors and narrow passages."""

    id: int = Field(description="Stays while the map grows; another map begins at 0.")
    area_m2: Rounded = Field(description="Of its free floor.")
    inside_m: Point = Field(description="x, y on its floor, as far from its edge as possible.")
    outlines_m: tuple[tuple[Point, ...], ...] = Field(
        description="Corners of the polygon around each part of its floor, to a cell, "
        "counter-clockwise, the largest part first, metres; holes are filled."
    )


class ChangedRooms(Reply):
    """A room that split into several, or several that joined."""

    before: tuple[int, ...] = Field(description="The ids before.")
    after: tuple[int, ...] = Field(description="The ids now; a new one, or one of those before.")


class RoomListReply(Reply):
    """The rooms of the map, by their ids."""

    rooms: tuple[MapRoom, ...]
    revision: int = Field(description="Of the map that was cut.")
    since: int | None = Field(
        description="Revision at which they were cut before, for whoever asked; null: never."
    )
    changes: tuple[ChangedRooms, ...] = Field(
        description="What split and joined since then, the same for all who ask at this revision."
    )


class MapPlace(Reply):
    """A part of the floor with a name: a room of the map, or a polygon."""

    name: str = Field(description="Whatever its case, no other place has it.")
    kind: str = Field(description="room, or keep_out: no robot enters it.")
    suggested: bool = Field(
        default=False, description="Named by what was found there, not by a person."
    )
    room: int | None = Field(
        default=None,
        description="Id of the room, as in /v1/rooms; null: a polygon, or no room is known there.",
    )
    inside_m: MaybePoint = Field(
        default=None, description="x, y in the room, which may grow around it; null: a polygon."
    )
    corners_m: tuple[Point, ...] = Field(default=(), description="Of the polygon; empty: a room.")
    outlines_m: tuple[tuple[Point, ...], ...] = Field(
        description="Of the room as it is now, as in /v1/rooms, or of the polygon."
    )
    area_m2: Rounded = Field(description="Of the room's free floor, or of the polygon.")


class PlaceListReply(Reply):
    """Places in the order of their naming, then suggested names."""

    places: tuple[MapPlace, ...]
    revision: int = Field(description="Of the map whose rooms these are.")
