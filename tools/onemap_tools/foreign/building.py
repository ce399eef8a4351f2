"""Walls, floors, ceilings, doors and windows of a floor plan."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from onemap_shared.geometry import F64
from onemap_tools.foreign import textures
from onemap_tools.foreign.apartment_plan import (
    WALL_M,
    ApartmentPlan,
    OpeningKind,
    PlannedRoom,
    Side,
    WallOpening,
)
from onemap_tools.foreign.finish import Finish, FinishedPart, finished, pictured
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.images import outdoors
from onemap_tools.foreign.lit_scene import AreaLight, PlacedObject
from onemap_tools.foreign.plain_mesh import PlainMesh, block, joined
from onemap_tools.foreign.shapes.parts import Parts, front, handle, moved, rotated
from onemap_tools.foreign.textures import mix

DAYLIGHT = (1.0, 1.04, 1.12)
WINDOW_STRENGTH = 3.4  # of a window of 1 m2
CEILING_STRENGTH = 1.5
SKIRTING_M = 0.08


def building(plan: ApartmentPlan, look: FinishPicker) -> tuple[list[PlacedObject], list[AreaLight]]:
    """Everything that stays when people move out, and its lights."""
    objects: list[PlacedObject] = []
    lights: list[AreaLight] = []
    for room in plan.rooms:
        objects += _surfaces(room, plan, look)
        lights.append(_ceiling_light(room, plan.height_m))
    for opening in plan.openings:
        if opening.kind is OpeningKind.WINDOW:
            objects.append(PlacedObject("window", "", tuple(_window(opening, look))))
            lights.append(_window_light(opening, plan))
        else:
            objects.append(PlacedObject("door", "", tuple(_door(opening, look))))
    return objects, lights


def side_frame(room: PlannedRoom, side: Side) -> tuple[F64, F64, F64, float]:
    """Start (2,), direction along (2,), normal into the room (2,) and length of a wall's face."""
    x0, y0, x1, y1 = room.bounds_m
    t = WALL_M / 2
    table = {
        Side.SOUTH: ((x0, y0 + t), (1, 0), (0, 1), x1 - x0),
        Side.NORTH: ((x0, y1 - t), (1, 0), (0, -1), x1 - x0),
        Side.WEST: ((x0 + t, y0), (0, 1), (1, 0), y1 - y0),
        Side.EAST: ((x1 - t, y0), (0, 1), (-1, 0), y1 - y0),
    }
    start, along, normal, length = table[side]
    return np.array(start, float), np.array(along, float), np.array(normal, float), length


def openings_of(
    room: PlannedRoom, side: Side, openings: tuple[WallOpening, ...]
) -> list[WallOpening]:
    """The openings in one wall of a room, in their order along it."""
    x0, y0, x1, y1 = room.bounds_m
    line = {Side.SOUTH: y0, Side.NORTH: y1, Side.WEST: x0, Side.EAST: x1}[side]
    axis, low, high = ("y", x0, x1) if side in (Side.SOUTH, Side.NORTH) else ("x", y0, y1)
    found = [o for o in openings if o.axis == axis and o.line == line and low < o.middle < high]
    return sorted(found, key=lambda opening: opening.middle)


def _surfaces(room: PlannedRoom, plan: ApartmentPlan, look: FinishPicker) -> list[PlacedObject]:
    x0, y0, x1, y1 = room.bounds_m
    paint, ground = _wall_finish(room.wall, look), _floor_finish(room.floor, look)
    panels, skirting = [], []
    for side in Side:
        start, along, normal, length = side_frame(room, side)
        at, low = 0.0, float(start @ along)
        for opening in openings_of(room, side, plan.openings):
            begin, end = (opening.middle + s * opening.width / 2 - low for s in (-1, 1))
            panels += [
                _panel(start, along, (at, begin), (0, plan.height_m)),
                _panel(start, along, (begin, end), (opening.head, plan.height_m)),
            ]
            if opening.sill > 0:
                panels.append(_panel(start, along, (begin, end), (0, opening.sill)))
            skirting.append(_skirting(start, along, normal, (at, end if opening.sill else begin)))
            at = end
        panels.append(_panel(start, along, (at, length), (0, plan.height_m)))
        skirting.append(_skirting(start, along, normal, (at, length)))
    floor = _level(x0, y0, x1, y1, 0.0)
    white = Finish(textures.plaster(look.rng, (0.95, 0.95, 0.94), 0.02), 2.0, 0.0)
    boards = look.lacquer((0.93, 0.93, 0.92))
    return [
        PlacedObject("floor", room.kind, (finished(floor, ground),)),
        PlacedObject(
            "ceiling", room.kind, (finished(_level(x0, y0, x1, y1, plan.height_m), white),)
        ),
        PlacedObject(
            "wall",
            room.kind,
            (finished(joined(panels), paint, upright=False), finished(joined(skirting), boards)),
        ),
    ]


def _panel(
    start: F64, along: F64, across: tuple[float, float], up: tuple[float, float]
) -> PlainMesh:
    """A rectangle of wall."""
    corners = [(across[0], up[0]), (across[1], up[0]), (across[1], up[1]), (across[0], up[1])]
    vertices = np.array([(*(start + a * along), z) for a, z in corners])
    return PlainMesh(vertices, np.array([[0, 1, 2], [0, 2, 3]], np.int64))


def _skirting(start: F64, along: F64, normal: F64, across: tuple[float, float]) -> PlainMesh:
    """The board along the foot of a wall."""
    length = max(across[1] - across[0], 0.001)
    middle = start + along * (across[0] + across[1]) / 2 + normal * 0.006
    wide, deep = (length, 0.012) if along[0] else (0.012, length)
    return block(wide, deep, SKIRTING_M, 0.002, 1).at(float(middle[0]), float(middle[1]))


def _level(x0: float, y0: float, x1: float, y1: float, z: float) -> PlainMesh:
    vertices = np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]])
    return PlainMesh(vertices, np.array([[0, 1, 2], [0, 2, 3]], np.int64))


def _wall_finish(kind: str, look: FinishPicker) -> Finish:
    rng, tone = look.rng, look.one_of(look.palette.walls)
    makers: dict[str, Callable[[], Finish]] = {
        "paint": lambda: Finish(textures.plaster(rng, tone), 2.0, 0.01),
        "paper": lambda: Finish(
            textures.wallpaper(rng, tone, mix(tone, (0.3, 0.3, 0.35), 0.3)), 1.0, 0.01
        ),
        "tiles": lambda: Finish(
            textures.tiles(rng, mix(tone, (1, 1, 1), 0.4), rows=6), 1.0, 0.3, 80.0, 0.05
        ),
        "metro": lambda: Finish(
            textures.tiles(rng, (0.9, 0.9, 0.88), rows=8, shift=0.5), 0.8, 0.3, 80.0, 0.05
        ),
        "bricks": lambda: Finish(textures.bricks(rng, (0.62, 0.32, 0.24)), 0.8, 0.01),
        "concrete": lambda: Finish(textures.concrete(rng), 2.0, 0.03),
    }
    return makers[kind]()


def _floor_finish(kind: str, look: FinishPicker) -> Finish:
    rng, tone = look.rng, look.one_of(look.palette.woods)
    makers: dict[str, Callable[[], Finish]] = {
        "planks": lambda: Finish(textures.planks(rng, tone), 1.1, 0.16, 40.0, 0.03),
        "parquet": lambda: Finish(textures.parquet(rng, tone), 1.2, 0.2, 50.0, 0.05),
        "tiles": lambda: Finish(
            textures.tiles(rng, (0.66, 0.63, 0.58), rows=3, vary=0.07), 1.0, 0.25, 70.0, 0.05
        ),
        "checker": lambda: Finish(
            textures.checker(rng, (0.9, 0.89, 0.86), (0.14, 0.14, 0.15)), 1.2, 0.35, 90.0, 0.07
        ),
        "terrazzo": lambda: Finish(
            textures.terrazzo(rng, (0.78, 0.76, 0.72)), 0.8, 0.3, 80.0, 0.05
        ),
        "carpet": lambda: Finish(textures.fur(rng, look.one_of(look.palette.textiles)), 0.6, 0.0),
        "concrete": lambda: Finish(textures.concrete(rng, (0.5, 0.5, 0.49)), 2.2, 0.3, 50.0, 0.06),
    }
    return makers[kind]()


def _door(opening: WallOpening, look: FinishPicker) -> Parts:
    """A frame, and a leaf on its hinge unless it is a passage; panelled, flush or with glass."""
    w, head = opening.width, opening.head
    paint = look.lacquer((0.92, 0.91, 0.88)) if look.rng.integers(2) else look.wood()
    posts = [block(0.05, WALL_M + 0.04, head, 0.006).at(s * (w / 2 - 0.015)) for s in (-1, 1)]
    posts.append(block(w + 0.06, WALL_M + 0.04, 0.06, 0.006).at(z=head - 0.03))
    parts: Parts = [finished(joined(posts), paint, upright=True)]
    if opening.kind is OpeningKind.DOOR:
        kind = int(look.rng.choice([0, 1, 2, 3]))
        leaf = rotated(
            moved(_leaf(w - 0.08, head - 0.05, kind, paint, look), (w - 0.08) / 2),
            yaw=opening.open_rad,
        )
        parts += moved(leaf, -w / 2 + 0.045, 0.0, 0.01)
    return _in_wall(parts, opening)


def _leaf(width: float, height: float, kind: int, paint: Finish, look: FinishPicker) -> Parts:
    """A door leaf about y = 0 with the same front on both sides."""
    faces = [block(width, 0.036, height, 0.003)]
    for side in (0.0, np.pi):
        fields = [(0.95, 0.1), (height - 1.25, 1.15)] if kind == 2 else []
        fronts = [front(width - 0.1, tall, 2).at(z=z) for tall, z in fields]
        fronts += [front(width, height, kind)] if kind in (1, 3) else []
        faces += [f.at(y=-0.018).turned(yaw=side) for f in fronts]
    grips = [
        handle(2, 0.13).at(width / 2 - 0.09, -0.02, 1.02),
        handle(2, 0.13).turned(yaw=np.pi).at(width / 2 - 0.09, 0.02, 1.02),
    ]
    return [finished(joined(faces), paint, upright=True), finished(joined(grips), look.steel())]


def _window(opening: WallOpening, look: FinishPicker) -> Parts:
    """A frame with bars, a sill board, and what is seen outside."""
    w, tall = opening.width, opening.head - opening.sill
    white = look.lacquer((0.94, 0.94, 0.93)) if look.rng.integers(2) else look.wood()
    count = max(round(w / 0.75), 1)
    bars = [
        block(0.06, 0.07, tall, 0.006).at(x)
        for x in np.linspace(-w / 2 + 0.03, w / 2 - 0.03, count + 1)
    ]
    bars += [block(w, 0.07, 0.06, 0.006).at(z=z) for z in (0.0, tall - 0.06)]
    if look.rng.integers(2):
        bars.append(block(w, 0.05, 0.03, 0.004).at(z=tall * 0.68))
    view = look.shown(
        outdoors(look.rng, (int(256 * min(tall / w, 1)), int(256 * min(w / tall, 1)))), 1.0
    )
    pane: list[FinishedPart] = moved([pictured(w, tall, view)], 0, 0.02)
    board = finished(block(w + 0.1, 0.2, 0.03, 0.006).at(0, -0.09, -0.03), white)
    parts = [*pane, finished(joined(bars), white), *([board] if opening.sill > 0.3 else [])]
    return _in_wall(moved(parts, z=opening.sill), opening)


def _in_wall(parts: Parts, opening: WallOpening) -> Parts:
    """Parts about the origin, set into their wall; windows look into the apartment."""
    yaw = 0.0 if opening.axis == "y" else np.pi / 2
    x, y = (opening.middle, opening.line) if opening.axis == "y" else (opening.line, opening.middle)
    if opening.kind is OpeningKind.WINDOW and _faces_back(opening):
        yaw += np.pi
    return moved(rotated(parts, yaw=yaw), x, y)


def _faces_back(opening: WallOpening) -> bool:
    """Whether an outer wall at x = line or y = line lies at the low end, where rooms are behind."""
    return opening.line == 0.0 if opening.axis == "y" else opening.line != 0.0


def _ceiling_light(room: PlannedRoom, height_m: float) -> AreaLight:
    x0, y0, x1, y1 = room.bounds_m
    area = (x1 - x0) * (y1 - y0)
    level = CEILING_STRENGTH * min(area / 9, 1.6)
    return AreaLight(
        ((x0 + x1) / 2, (y0 + y1) / 2, height_m - 0.25),
        (0.25, 0.25, 0.05),
        (level, 0.92 * level, 0.78 * level),
    )


def _window_light(opening: WallOpening, plan: ApartmentPlan) -> AreaLight:
    inward = 1.0 if opening.line == 0.0 else -1.0
    z, tall = (opening.sill + opening.head) / 2, opening.head - opening.sill
    strength = WINDOW_STRENGTH * plan.daylight * min(opening.width * tall, 2.5)
    red, green, blue = (strength * c for c in DAYLIGHT)
    place = opening.line + inward * 0.1
    if opening.axis == "y":
        return AreaLight(
            (opening.middle, place, z),
            (opening.width * 0.45, 0.01, tall * 0.45),
            (red, green, blue),
            (0, inward, 0),
        )
    return AreaLight(
        (place, opening.middle, z),
        (0.01, opening.width * 0.45, tall * 0.45),
        (red, green, blue),
        (inward, 0, 0),
    )
