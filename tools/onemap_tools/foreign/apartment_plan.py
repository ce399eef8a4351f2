"""What an apartment is described with: rooms, openings in walls, and where things stand."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from onemap_tools.foreign.finish_picker import ApartmentPalette

WALL_M = 0.12  # thickness
DOOR_HEAD_M = 2.03


class Side(Enum):
    """The wall of a room in a direction of the map: x points east, y north."""

    NORTH = "N"
    EAST = "E"
    SOUTH = "S"
    WEST = "W"


class OpeningKind(Enum):
    """A door has a leaf, a passage only a frame, a window glass."""

    DOOR = "door"
    PASSAGE = "passage"
    WINDOW = "window"


@dataclass(frozen=True, slots=True)
class WallOpening:
    """A hole in the wall at x = line or y = line (``axis``), about ``middle`` along it; metres.

    open_rad: how far the leaf of a door stands open.
    """

    kind: OpeningKind
    axis: str
    line: float
    middle: float
    width: float = 0.9
    sill: float = 0.0
    head: float = DOOR_HEAD_M
    open_rad: float = 1.6


@dataclass(frozen=True, slots=True)
class Slot:
    """A place for a piece of a class in a room.

    side: the wall that its back stands to, ``at`` metres from the wall's western or southern end
    and ``height_m`` up (of a curtain: its rod); None: free, its middle at ``at`` and ``across``
    metres from the room's south-western corner, turned by ``turn_deg``. on: class of the piece
    placed before it in this room that carries it, with ``at`` and ``across`` in the carrier's axes.
    shapes: allowed ones.
    """

    category: str
    side: Side | None = None
    at: float = 0.0
    across: float = 0.0
    turn_deg: float = 0.0
    height_m: float = 0.0
    on: str = ""
    shapes: tuple[int, ...] = tuple(range(8))


@dataclass(frozen=True, slots=True)
class PlannedRoom:
    """A room: bounds x_min, y_min, x_max, y_max in metres, surfaces by name, things."""

    kind: str
    bounds_m: tuple[float, float, float, float]
    floor: str
    wall: str
    slots: tuple[Slot, ...] = field(default=())


@dataclass(frozen=True, slots=True)
class ApartmentPlan:
    """An apartment; height_m: of its rooms; balance: white balance of its camera."""

    name: str
    rooms: tuple[PlannedRoom, ...]
    openings: tuple[WallOpening, ...]
    palette: ApartmentPalette
    height_m: float
    start: tuple[float, float, float]
    balance: tuple[float, float, float] = (1.0, 1.0, 1.0)
    daylight: float = 1.0


ALL_SHAPES: tuple[int, ...] = tuple(range(8))


def wall(
    category: str, side: str, at: float, height_m: float = 0.0, shapes: tuple[int, ...] = ALL_SHAPES
) -> Slot:
    """A piece with its back to a wall, hung if it has a height."""
    return Slot(category, Side(side), at, height_m=height_m, shapes=shapes)


def free(
    category: str, x: float, y: float, turn_deg: float = 0.0, shapes: tuple[int, ...] = ALL_SHAPES
) -> Slot:
    """A piece that stands anywhere in the room."""
    return Slot(category, None, x, y, turn_deg, shapes=shapes)


def on(
    category: str,
    carrier: str,
    x: float = 0.0,
    y: float = 0.0,
    turn_deg: float = 0.0,
    *,
    shapes: tuple[int, ...] = ALL_SHAPES,
) -> Slot:
    """A piece on another: x to its right and y to its back from its middle."""
    return Slot(category, None, x, y, turn_deg, on=carrier, shapes=shapes)
