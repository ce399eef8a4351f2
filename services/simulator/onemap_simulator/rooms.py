"""What stands in which room, and how."""

from __future__ import annotations

import numpy as np

from onemap_simulator.arrange import Arranger
from onemap_simulator.furniture.seating import armchair, bench, chair, sofa, stool
from onemap_simulator.furniture.structure import curtain, rug
from onemap_simulator.furniture.tables import coffee_table, desk, table
from onemap_simulator.mesh import rotation
from onemap_simulator.model import Model
from onemap_simulator.pick import Pick
from onemap_simulator.plan import HALF_WALL_M, Opening, Plan
from onemap_simulator.shell import facing
from onemap_simulator.site import Placed, Site, place


def furnish(room: Arranger) -> None:
    """Fill the room after its kind."""
    kind = room.site.plan.spaces[room.space].kind
    recipe = {
        "living room": _living_room,
        "kitchen": _kitchen,
        "bedroom": _bedroom,
        "study": _study,
        "dining room": _dining_room,
        "hallway": _hallway,
    }.get(kind)
    if recipe is not None:
        recipe(room)


def hang_curtains(site: Site, pick: Pick) -> None:
    """Curtains at one or both sides of most windows, in front of the wall."""
    plan = site.plan
    for hole in plan.windows:
        space = hole.spaces[0]
        if plan.spaces[space].kind in ("bathroom", "kitchen") or pick.chance(0.35):
            continue
        pair = curtain(pick, pick.size(0.3, 0.45), hole.top + 0.06)
        short = curtain(pick, pick.size(0.3, 0.45), hole.top - hole.sill + 0.25)
        for model in (pair, short) if pick.chance(0.5) else (short,):
            things = _beside_window(model, hole, plan)
            if all([site.add([thing], ignoring=site.window_boxes) for thing in things]):
                break


def _beside_window(model: Model, hole: Opening, plan: Plan) -> list[Placed]:
    """The same curtain left and right of a window, its rod 12 cm above the window."""
    space = hole.spaces[0]
    turn = facing(hole, plan, space)
    things = []
    for side in (-1, 1):
        offset = (side * (hole.width / 2 + model.upper[0] - 0.16), -HALF_WALL_M - 0.14, 0.0)
        x, y, _ = rotation("z", turn) @ offset
        at = (hole.centre[0] + x, hole.centre[1] + y, hole.top + 0.15 - model.upper[2])
        things.append(place(model, at, turn, space))
    return things


def _dining_set(room: Arranger) -> None:
    pick = room.pick
    model, seat = table(pick), chair(pick)
    for _ in range(3):
        half_x, half_y = model.upper[0], model.upper[1]
        depth = seat.upper[1] - seat.lower[1]
        out = half_y + depth / 2 - 0.12
        count = 1 if half_x < 0.75 else 2
        offsets = [(x, 0.0) for x in np.linspace(-0.3, 0.3, count)] if count > 1 else [(0.0, 0.0)]
        around = [(seat, np.array([x, -out, 0.0]), 180.0) for x, _ in offsets]
        around += [(seat, np.array([x, out, 0.0]), 0.0) for x, _ in offsets]
        if room.in_middle(model, around) is not None:
            return
        model = table(pick)
    room.against_wall(model)


def _living_room(room: Arranger) -> None:
    pick = room.pick
    couch = room.against_wall(sofa(pick)) or room.against_wall(armchair(pick))
    if couch is not None:
        reach = couch.model.lower[1]
        low = coffee_table(pick)
        room.near(couch, low, np.array([0.0, reach - 0.35 - low.upper[1], 0.0]), 0.0)
        carpet = rug(pick, pick.size(1.6, 2.4), pick.size(1.1, 1.6))
        room.near(couch, carpet, np.array([0.0, reach - 0.6, 0.0]), 0.0)
    room.in_corner(armchair(pick))
    _dining_set(room)


def _kitchen(room: Arranger) -> None:
    _dining_set(room)
    room.against_wall(stool(room.pick))


def _bedroom(room: Arranger) -> None:
    room.against_wall(bench(room.pick))
    room.against_wall(armchair(room.pick))


def _study(room: Arranger) -> None:
    pick = room.pick
    work = room.against_wall(desk(pick))
    if work is not None:
        seat = chair(pick)
        out = work.model.lower[1] - seat.upper[1] + 0.1
        room.near(work, seat, np.array([0.0, out, 0.0]), 180.0)
    room.against_wall(sofa(pick))


def _dining_room(room: Arranger) -> None:
    _dining_set(room)
    room.against_wall(bench(room.pick))


def _hallway(room: Arranger) -> None:
    room.against_wall(stool(room.pick))
