"""Floor plans: rooms that share walls, the doors between them and the windows."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from onemap_simulator.generation.style import Sampler

Rect = tuple[float, float, float, float]  # x_min, y_min, x_max, y_max in metres
Wall = tuple[int, float, float, float]  # axis along it, coordinate across it, start, end

HALF_WALL_M = 0.06
DOOR_HEIGHT_M = 2.05
CORNER_GAP_M = 0.08  # from a room's corner to a door's opening, for the open leaf
SIDES = ("west", "south", "east", "north")


@dataclass(frozen=True, slots=True)
class Space:
    """A room: its kind and the rectangle between the centre lines of its walls."""

    kind: str
    rect: Rect

    @property
    def inner(self) -> Rect:
        """The rectangle between the faces of the walls."""
        x0, y0, x1, y1 = self.rect
        return (x0 + HALF_WALL_M, y0 + HALF_WALL_M, x1 - HALF_WALL_M, y1 - HALF_WALL_M)

    def side(self, name: str) -> Wall:
        """The centre line of one of its walls."""
        x0, y0, x1, y1 = self.rect
        return {
            "west": (1, x0, y0, y1),
            "east": (1, x1, y0, y1),
            "south": (0, y0, x0, x1),
            "north": (0, y1, x0, x1),
        }[name]


@dataclass(frozen=True, slots=True)
class Opening:
    """A hole in a wall that runs along ``axis`` (0: x, 1: y) at coordinate ``line``.

    It spans ``start`` to ``end`` along the wall and ``sill`` to ``top`` in height. ``spaces``
    are the indices of the rooms on both sides; a window and the entrance have one.
    """

    axis: int
    line: float
    start: float
    end: float
    sill: float
    top: float
    spaces: tuple[int, ...]

    @property
    def centre(self) -> tuple[float, float]:
        """x, y of its middle."""
        middle = (self.start + self.end) / 2
        return (middle, self.line) if self.axis == 0 else (self.line, middle)

    @property
    def width(self) -> float:
        """Clear width in metres."""
        return self.end - self.start


@dataclass(frozen=True, slots=True)
class FloorPlan:
    """An apartment without furniture. Space 0 is the hub: every other room opens onto it."""

    spaces: tuple[Space, ...]
    doors: tuple[Opening, ...]
    entrance: Opening
    windows: tuple[Opening, ...]
    height_m: float


def sample_floor_plan(draw: Sampler) -> FloorPlan:
    """A floor plan of five to seven rooms, about 70 to 120 square metres."""
    rects = draw.choice([_along_corridor, _beside_living_room, _around_living_room])(draw)
    if draw.chance(0.5):
        rects = [(y0, x0, y1, x1) for x0, y0, x1, y1 in rects]
    spaces = _name(draw, rects)
    hub_doors = [_door(draw, spaces, other) for other in range(1, len(spaces))]
    doors = (*hub_doors, *_passages(draw, spaces))
    entrance, windows = _outer_openings(draw, spaces)
    return FloorPlan(spaces, doors, entrance, windows, draw.uniform(2.45, 2.8))


def _split(draw: Sampler, start: float, total: float, count: int, small: float) -> list[float]:
    """Borders (count + 1) of ``count`` rooms in a row; ``small`` > 0 sets one of them to it."""
    shares = np.array([draw.uniform(0.85, 1.2) for _ in range(count)])
    if small > 0 and count > 1:
        index = draw.integer(0, count - 1)
        others = np.arange(count) != index
        shares[others] *= (total - small) / shares[others].sum()
        shares[index] = small
    else:
        shares *= total / shares.sum()
    return [start, *(start + np.cumsum(shares)).tolist()]


def _row(borders: list[float], y0: float, y1: float) -> list[Rect]:
    return [(a, y0, b, y1) for a, b in pairwise(borders)]


def _along_corridor(draw: Sampler) -> list[Rect]:
    """A corridor along x with rooms on both sides."""
    width, hall = draw.uniform(9.2, 10.4), draw.uniform(1.5, 1.8)
    below, above = draw.uniform(3.3, 3.8), draw.uniform(3.3, 4.0)
    first, second = draw.choice([(2, 3), (3, 2), (3, 3)])
    bath = draw.uniform(2.1, 2.6)
    south = _split(draw, 0.0, width, first, bath if first == 3 else 0.0)
    north = _split(draw, 0.0, width, second, 0.0 if first == 3 else bath)
    return [
        (0.0, below, width, below + hall),
        *_row(south, 0.0, below),
        *_row(north, below + hall, below + hall + above),
    ]


def _beside_living_room(draw: Sampler) -> list[Rect]:
    """A living room as deep as the apartment, beside it a corridor between two rows of rooms."""
    living, width = draw.uniform(4.0, 4.6), draw.uniform(6.0, 7.0)
    hall, below, above = (draw.uniform(1.5, 1.8), draw.uniform(3.0, 3.6), draw.uniform(3.0, 3.6))
    bath = draw.uniform(2.1, 2.6)
    depth = below + hall + above
    south = _split(draw, living, width, 2, bath)
    north = _split(draw, living, width, 2, 0.0)
    return [
        (living, below, living + width, below + hall),
        (0.0, 0.0, living, depth),
        *_row(south, 0.0, below),
        *_row(north, below + hall, depth),
    ]


def _around_living_room(draw: Sampler) -> list[Rect]:
    """A living room in the middle, with rooms to the west and to the east."""
    west, hub, east = (draw.uniform(3.0, 3.5), draw.uniform(4.0, 4.6), draw.uniform(3.0, 3.5))
    depth, bath = draw.uniform(7.2, 8.2), draw.uniform(2.1, 2.5)
    left = _split(draw, 0.0, depth, 2, 0.0)
    right = _split(draw, 0.0, depth, 3 if depth > 7.7 else 2, bath)
    return [
        (west, 0.0, west + hub, depth),
        *[(0.0, a, west, b) for a, b in pairwise(left)],
        *[(west + hub, a, west + hub + east, b) for a, b in pairwise(right)],
    ]


def _name(draw: Sampler, rects: list[Rect]) -> tuple[Space, ...]:
    """Kinds for the rooms: the smallest is the bathroom, the largest the living room."""
    areas = [(x1 - x0) * (y1 - y0) for x0, y0, x1, y1 in rects]
    kinds = [""] * len(rects)
    x0, y0, x1, y1 = rects[0]
    others = sorted(range(1, len(rects)), key=lambda index: areas[index])
    if min(x1 - x0, y1 - y0) < 2.0:
        kinds[0] = "hallway"
        kinds[others.pop()] = "living room"
    else:
        kinds[0] = "living room"
    kinds[others.pop(0)] = "bathroom"
    rest = ["kitchen", "bedroom", *draw.rng.permutation(["study", "dining room", "bedroom"])]
    order = draw.rng.permutation(len(others))
    for index, kind in zip(order, rest, strict=False):
        kinds[others[index]] = str(kind)
    return tuple(Space(kind, rect) for kind, rect in zip(kinds, rects, strict=True))


def _shared(first: Space, second: Space) -> Wall | None:
    """The wall between two rooms, if they share one."""
    a, b = first.rect, second.rect
    for axis, across in ((0, 1), (1, 0)):
        start, end = max(a[axis], b[axis]), min(a[axis + 2], b[axis + 2])
        for line, other in ((a[across], b[across + 2]), (a[across + 2], b[across])):
            if abs(line - other) < 1e-6 and end - start > 0.5:
                return (axis, line, start, end)
    return None


def _doorway(wall: Wall, begin: float, width: float, spaces: tuple[int, ...]) -> Opening:
    axis, line, _, _ = wall
    return Opening(axis, line, begin, begin + width, 0.0, DOOR_HEIGHT_M, spaces)


def _door(draw: Sampler, spaces: tuple[Space, ...], other: int) -> Opening:
    """A door near one end of the wall between the hub and another room."""
    wall = _shared(spaces[0], spaces[other])
    if wall is None:
        raise ValueError(f"room {other} shares no wall with the hub")
    low, end = wall[2] + HALF_WALL_M + CORNER_GAP_M, wall[3]
    width = min(draw.uniform(0.95, 1.1), end - wall[2] - 2 * (HALF_WALL_M + CORNER_GAP_M))
    high = end - HALF_WALL_M - CORNER_GAP_M - width
    return _doorway(wall, draw.choice([low, high, draw.uniform(low, high)]), width, (0, other))


def _passages(draw: Sampler, spaces: tuple[Space, ...]) -> list[Opening]:
    """In most cases a wide passage between the kitchen and a neighbouring living or dining room."""
    kitchen = next(i for i, space in enumerate(spaces) if space.kind == "kitchen")
    for other in range(1, len(spaces)):
        if spaces[other].kind not in ("living room", "dining room") or draw.chance(0.3):
            continue
        wall = _shared(spaces[kitchen], spaces[other])
        if wall is not None and wall[3] - wall[2] > 2.6:
            width = draw.uniform(1.2, 1.6)
            begin = draw.uniform(wall[2] + 0.4, wall[3] - 0.4 - width)
            return [_doorway(wall, begin, width, (min(kitchen, other), max(kitchen, other)))]
    return []


def _outer_openings(
    draw: Sampler, spaces: tuple[Space, ...]
) -> tuple[Opening, tuple[Opening, ...]]:
    """The entrance in an outer wall of the hub, and windows in the other outer walls."""
    x_min, y_min = np.min([space.rect[:2] for space in spaces], axis=0)
    x_max, y_max = np.max([space.rect[2:] for space in spaces], axis=0)
    outer = {"west": x_min, "south": y_min, "east": x_max, "north": y_max}
    entrance: Opening | None = None
    windows = []
    for index, space in enumerate(spaces):
        for name in SIDES:
            axis, line, start, end = space.side(name)
            if abs(line - outer[name]) > 1e-6:
                continue
            if index == 0 and entrance is None:
                middle = draw.uniform(start + 0.7, end - 0.7)
                ends = (middle - 0.48, middle + 0.48)
                entrance = Opening(axis, line, *ends, 0.0, DOOR_HEIGHT_M, (0,))
            elif space.kind != "hallway" and draw.chance(0.85):
                windows.append(_window(draw, index, space, name))
    if entrance is None:
        raise ValueError("the hub has no outer wall")
    return entrance, tuple(windows)


def _window(draw: Sampler, index: int, space: Space, side: str) -> Opening:
    axis, line, start, end = space.side(side)
    if space.kind == "bathroom":
        width, sill = draw.uniform(0.6, 0.8), 1.3
    else:
        width = min(draw.uniform(1.0, 1.7), end - start - 0.8)
        sill = draw.choice([0.9, 0.9, 0.6]) if space.kind != "kitchen" else 1.1
    begin = draw.uniform(start + 0.4, end - 0.4 - width)
    return Opening(axis, line, begin, begin + width, sill, draw.uniform(2.0, 2.2), (index,))
