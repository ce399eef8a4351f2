"""The furniture of each kind of room, small objects, curtains, and categories still missing."""

from __future__ import annotations

from functools import partial

import numpy as np

from onemap_simulator.generation.floor_plan import HALF_WALL_M
from onemap_simulator.generation.furniture import (
    bathroom,
    decor,
    electronics,
    kitchen,
    seats_and_tables,
    storage,
)
from onemap_simulator.generation.furniture.bathroom import towel, washing_machine
from onemap_simulator.generation.furniture.decor import (
    clock,
    floor_plant,
    guitar,
    mirror,
    picture,
    small_plant,
    teddy_bear,
    vase,
)
from onemap_simulator.generation.furniture.electronics import floor_lamp, radiator, table_lamp
from onemap_simulator.generation.furniture.kitchen import book, bottle, bowl, cup
from onemap_simulator.generation.furniture.seats_and_tables import armchair, bench, chair, stool
from onemap_simulator.generation.furniture.storage import basket, dresser, shelf, trash_can
from onemap_simulator.generation.mesh import Model, rotation
from onemap_simulator.generation.placement import PlacedModel, Placer, RoomLayout, place
from onemap_simulator.generation.structure import facing_yaw_deg
from onemap_simulator.generation.style import ModelFactory, Sampler

standing_television = partial(electronics.television, hanging=False)
hanging_television = partial(electronics.television, hanging=True)


def furnish(placer: Placer) -> None:
    """Furnish the room according to its kind."""
    recipes = {
        "living room": _living_room,
        "kitchen": _kitchen,
        "bathroom": _bathroom,
        "bedroom": _bedroom,
        "study": _study,
        "dining room": _dining_room,
        "hallway": _hallway,
    }
    recipes[placer.layout.plan.spaces[placer.space].kind](placer)


def _dining_set(placer: Placer) -> None:
    """A table with chairs tucked under it, in the room if possible."""
    seat = chair(placer.draw)
    depth = float(np.ptp([seat.lower[1], seat.upper[1]]))
    for _ in range(3):
        model = seats_and_tables.table(placer.draw)
        out = float(model.upper[1]) + depth / 2 - 0.14
        shifts = [-0.3, 0.3] if model.upper[0] > 0.72 else [0.0]
        front = [(seat, np.array([x, -out, 0.0]), 180.0) for x in shifts]
        back = [(seat, np.array([x, out, 0.0]), 0.0) for x in shifts]
        group = placer.in_middle(model, front + back) or placer.in_middle(model, front)
        if group is not None:
            placer.on_tops(group[:1], (0.6, bowl), (0.6, bottle), (0.6, cup), (0.5, vase))
            return


def _sofa_corner(placer: Placer) -> None:
    """A sofa with cushions, a coffee table and a rug in front."""
    draw = placer.draw
    for make in (seats_and_tables.sofa, seats_and_tables.sofa, armchair):
        couch = placer.against_wall(make(draw))
        if couch is not None:
            break
    else:
        return
    reach = float(couch.model.lower[1])
    low = seats_and_tables.coffee_table(draw)
    at = np.array([0.0, reach - draw.uniform(0.4, 0.7) - low.upper[1], 0.0])
    stand = placer.near(couch, low, at, 0.0)
    if stand is not None:
        placer.on_tops([stand], (0.7, book), (0.5, cup), (0.3, bowl), (0.3, vase))
    carpet = decor.rug(draw, draw.size(1.6, 2.4), draw.size(1.1, 1.6))
    placer.near(couch, carpet, np.array([0.0, reach - 0.6, 0.0]), 0.0)
    pillow = seats_and_tables.pillow
    placer.on_tops([couch], (0.7, pillow), (0.5, pillow), (0.4, teddy_bear))


def _television(placer: Placer) -> None:
    draw = placer.draw
    if draw.chance(0.5):
        stand = placer.against_wall(dresser(draw))
        model = standing_television(draw)
        if stand is not None and placer.on_top(model, stand, yaw_deg=0.0) is not None:
            return
    placer.against_wall(hanging_television(draw), z=draw.uniform(0.85, 1.0))


def _living_room(placer: Placer) -> None:
    draw = placer.draw
    _sofa_corner(placer)
    _television(placer)
    placer.along_walls((0.8, storage.bookcase), (0.6, armchair), (0.7, radiator))
    kinds = [space.kind for space in placer.layout.plan.spaces]
    if "dining room" not in kinds or draw.chance(0.3):
        _dining_set(placer)
    for make in (floor_lamp, floor_plant):
        if draw.chance(0.75):
            placer.in_corner(make(draw))
    supports = placer.along_walls((0.5, shelf), (0.4, dresser))
    placer.on_tops(supports, (0.6, small_plant), (0.6, vase), (0.5, book), (0.4, table_lamp))
    placer.along_walls((0.4, guitar), (0.3, basket), (0.3, electronics.standing_fan))
    placer.on_walls((0.9, picture), (0.5, picture), (0.5, clock))


def _kitchen(placer: Placer) -> None:
    _kitchen_row(placer)
    placer.along_walls((0.6, trash_can), (0.6, radiator), (0.5, stool), (0.3, shelf))
    _dining_set(placer)
    placer.on_walls((0.8, clock), (0.3, picture), (0.4, towel))


def _kitchen_row(placer: Placer) -> None:
    """Sink, oven, dishwasher, cabinets and refrigerator in one row, or in two if it is too long."""
    draw, look = placer.draw, kitchen.kitchen_look(placer.draw)
    units = [
        kitchen.kitchen_sink(draw, draw.size(0.6, 0.8), look),
        kitchen.oven(draw),
        kitchen.dishwasher(draw, look[1]),
        kitchen.kitchen_cabinet(draw, draw.size(0.5, 0.8), look),
        kitchen.kitchen_cabinet(draw, draw.size(0.4, 0.6), look),
    ]
    units = [units[index] for index in draw.rng.permutation(len(units))]
    fridge = kitchen.refrigerator(draw)
    placed = placer.in_row([*units, fridge]) or placer.in_row([*units[:-1], fridge])
    if placed is None:
        placed = [*(placer.in_row(units[:3]) or []), *(placer.in_row(units[3:]) or [])]
        alone = placer.in_corner(fridge)
        placed += [alone] if alone is not None else []
    have = {id(item.model) for item in placed}
    for model in (*units, fridge):
        if id(model) not in have:
            extra = placer.against_wall(model)
            placed += [extra] if extra is not None else []
    placer.along_walls((0.3, washing_machine))
    for item in placed:  # cabinets on the wall above base units
        width = float(np.ptp([item.model.lower[0], item.model.upper[0]]))
        if item.model.tops and draw.chance(0.75):
            model = kitchen.wall_cabinet(draw, width, look)
            offset = np.array([0.0, kitchen.DEPTH_M / 2 - float(model.upper[1]), 1.42])
            placer.near(item, model, offset, 0.0)
    supports = [item for item in placed if item.model.tops]
    placer.on_tops(
        supports, (0.85, kitchen.microwave), (0.9, kitchen.kettle), (0.85, kitchen.toaster)
    )
    placer.on_tops(supports, (0.6, bottle), (0.5, bowl), (0.5, cup))


def _bathroom(placer: Placer) -> None:
    draw = placer.draw
    wet = [bathroom.bathtub, bathroom.shower]
    if not draw.chance(0.5):
        wet.reverse()
    washed = False
    for make in wet:
        if not washed or draw.chance(0.8):
            model = make(draw)
            washed = bool(placer.in_corner(model) or placer.against_wall(model)) or washed
    placer.along_walls((1.0, bathroom.toilet))
    basin = placer.against_wall(bathroom.bathroom_sink(draw))
    if basin is not None:
        back = float(basin.model.upper[1])
        placer.near(basin, mirror(draw), np.array([0.0, back, 1.1]), 0.0)
    machines = placer.along_walls((0.6, washing_machine), (0.5, radiator))
    supports = [machine for machine in machines if machine.model.tops]
    placer.on_tops(supports, (0.4, basket), (0.4, bottle))
    placer.on_walls((0.9, towel), (0.5, towel), (0.2 if basin else 0.8, mirror))
    placer.along_walls((0.6, basket), (0.6, trash_can), (0.4, shelf))


def _bedroom(placer: Placer) -> None:
    for _ in range(3):
        rest = placer.against_wall(seats_and_tables.bed(placer.draw))
        if rest is not None:
            _bedside(placer, rest)
            break
    placer.along_walls((0.95, storage.wardrobe))
    chest = placer.along_walls((0.8, dresser))
    small = (0.5, small_plant), (0.5, vase), (0.5, book)
    placer.on_tops(chest, *small, (0.3, standing_television), (0.4, teddy_bear))
    placer.along_walls((0.7, radiator), (0.4, armchair), (0.3, bench), (0.4, storage.suitcase))
    placer.along_walls((0.3, floor_lamp), (0.4, electronics.standing_fan), (0.4, guitar))
    placer.along_walls((0.3, basket))
    toys = (0.35, decor.ball), (0.35, teddy_bear), (0.35, storage.cardboard_box)
    placer.on_floor((0.6, _small_rug), *toys)
    placer.on_walls((0.8, picture), (0.5, mirror), (0.3, clock))


def _bedside(placer: Placer, rest: PlacedModel) -> None:
    """Pillows on the bed and a nightstand with a lamp on each free side."""
    head, top = seats_and_tables.pillow(placer.draw), rest.model.tops[0]
    for x in (-0.36, 0.36) if rest.model.upper[0] > 0.6 else (0.0,):
        placer.near(rest, head, np.array([x, (top.y_min + top.y_max) / 2, top.z]), 0.0)
    stand = storage.nightstand(placer.draw)
    x = float(rest.model.upper[0]) + float(stand.upper[0]) + 0.04
    y = float(rest.model.upper[1] - stand.upper[1])
    for side in (-1, 1):
        placed = placer.near(rest, stand, np.array([side * x, y, 0.0]), 0.0)
        if placed is not None:
            placer.on_tops([placed], (0.7, table_lamp), (0.4, book), (0.4, cup))


def _small_rug(draw: Sampler) -> Model:
    return decor.rug(draw, draw.size(1.2, 1.8), draw.size(0.8, 1.2))


def _study(placer: Placer) -> None:
    work = placer.against_wall(seats_and_tables.desk(placer.draw))
    if work is not None:
        seat = chair(placer.draw)
        out = work.model.lower[1] - seat.upper[1] + 0.12
        placer.near(work, seat, np.array([0.0, out, 0.0]), 180.0)
        small = (0.95, electronics.laptop), (0.6, table_lamp), (0.5, book), (0.5, cup)
        placer.on_tops([work], *small)
    bookcase = storage.bookcase
    supports = placer.along_walls((0.9, bookcase), (0.5, bookcase), (0.7, shelf), (0.4, dresser))
    placer.on_tops(supports, (0.6, small_plant), (0.6, book), (0.4, vase), (0.3, bottle))
    placer.along_walls((0.3, decor.bicycle), (0.5, radiator), (0.5, armchair), (0.5, guitar))
    placer.along_walls((0.5, trash_can), (0.5, storage.cardboard_box), (0.5, floor_plant))
    placer.on_floor((0.5, _small_rug))
    placer.on_walls((0.8, picture), (0.6, clock))


def _dining_room(placer: Placer) -> None:
    _dining_set(placer)
    supports = placer.along_walls((0.8, dresser), (0.4, shelf), (0.4, bench))
    small = (0.7, vase), (0.6, bowl), (0.6, bottle), (0.5, small_plant), (0.4, cup)
    placer.on_tops(supports, *small)
    placer.along_walls((0.6, radiator), (0.6, floor_plant), (0.4, floor_lamp), (0.3, stool))
    placer.on_walls((0.8, picture), (0.5, picture), (0.5, clock))


def _hallway(placer: Placer) -> None:
    placer.along_walls((0.6, decor.bicycle))
    supports = placer.along_walls((0.5, dresser), (0.3, bench), (0.4, shelf))
    placer.on_tops(supports, (0.5, vase), (0.5, basket), (0.4, table_lamp), (0.4, small_plant))
    placer.along_walls((0.4, storage.suitcase), (0.3, storage.cardboard_box), (0.3, basket))
    placer.on_walls((0.6, mirror), (0.7, picture), (0.3, clock))


def add_missing(layout: RoomLayout, draw: Sampler) -> None:
    """Add most of the categories that are missing, in rooms where they are usual."""
    for category, make, kinds, how in _EXTRAS:
        have = {item.model.category for item in layout.placed}
        if category in have or draw.chance(0.1):
            continue
        spaces = enumerate(layout.plan.spaces)
        allowed = [index for index, space in spaces if not kinds or space.kind in kinds]
        model = make(draw)
        for index in draw.rng.permutation(allowed):
            placer = Placer(layout, draw, int(index))
            if how == "top":
                here = [item for item in layout.placed if item.space == index and item.model.tops]
                done = placer.on_any([item for item in here if _suits(category, item)], model)
            elif how == "wall":
                done = placer.hanging(model) is not None
            else:
                done = placer.against_wall(model) is not None
            if done:
                break


def _suits(category: str, support: PlacedModel) -> bool:
    """Whether the category is usual on the support: pillows on soft furniture only, cups not."""
    soft = support.model.category in ("sofa", "armchair", "bed")
    return category == "teddy bear" or soft == (category == "pillow")


_DAY = ("living room", "study", "dining room")
_LIVED_IN = (*_DAY, "bedroom")

# Category, factory, kinds of room (empty: any), and where: floor (at a wall), top or wall.
_EXTRAS: tuple[tuple[str, ModelFactory, tuple[str, ...], str], ...] = (
    ("refrigerator", kitchen.refrigerator, ("kitchen", "dining room", "hallway"), "floor"),
    ("wardrobe", storage.wardrobe, ("bedroom", "hallway", "study"), "floor"),
    ("sofa", seats_and_tables.sofa, ("living room", "study", "bedroom"), "floor"),
    ("coffee table", seats_and_tables.coffee_table, ("living room", "study"), "floor"),
    ("bicycle", decor.bicycle, ("hallway", *_LIVED_IN), "floor"),
    ("washing machine", washing_machine, ("kitchen", "bathroom", "hallway"), "floor"),
    ("desk", seats_and_tables.desk, _LIVED_IN, "floor"),
    ("bookcase", storage.bookcase, (*_LIVED_IN, "hallway"), "floor"),
    ("dresser", dresser, (*_LIVED_IN, "hallway"), "floor"),
    ("armchair", armchair, _LIVED_IN, "floor"),
    ("shelf", shelf, (), "floor"),
    ("bench", bench, (*_LIVED_IN, "hallway"), "floor"),
    ("stool", stool, (*_LIVED_IN, "kitchen", "hallway"), "floor"),
    ("chair", chair, (*_LIVED_IN, "kitchen"), "floor"),
    ("nightstand", storage.nightstand, ("bedroom",), "floor"),
    ("radiator", radiator, (), "floor"),
    ("guitar", guitar, _LIVED_IN, "floor"),
    ("suitcase", storage.suitcase, ("bedroom", "hallway", "study", "living room"), "floor"),
    ("basket", basket, (), "floor"),
    ("box", storage.cardboard_box, (), "floor"),
    ("trash can", trash_can, (), "floor"),
    ("ball", decor.ball, _LIVED_IN, "floor"),
    ("lamp", floor_lamp, _LIVED_IN, "floor"),
    ("fan", electronics.standing_fan, _LIVED_IN, "floor"),
    ("potted plant", floor_plant, (), "floor"),
    ("laptop", electronics.laptop, (*_LIVED_IN, "kitchen"), "top"),
    ("microwave", kitchen.microwave, ("kitchen", "dining room"), "top"),
    ("kettle", kitchen.kettle, ("kitchen", "dining room", "living room"), "top"),
    ("toaster", kitchen.toaster, ("kitchen", "dining room", "living room"), "top"),
    ("teddy bear", teddy_bear, _LIVED_IN, "top"),
    ("pillow", seats_and_tables.pillow, ("bedroom", "living room"), "top"),
    ("vase", vase, (), "top"),
    ("bottle", bottle, (), "top"),
    ("bowl", bowl, (), "top"),
    ("cup", cup, (), "top"),
    ("book", book, (), "top"),
    ("fan", electronics.table_fan, (), "top"),
    ("lamp", table_lamp, (), "top"),
    ("towel", towel, ("bathroom", "kitchen"), "wall"),
    ("mirror", mirror, (), "wall"),
    ("clock", clock, (), "wall"),
    ("picture", picture, (), "wall"),
    ("television", hanging_television, _LIVED_IN, "wall"),
)


def hang_curtains(layout: RoomLayout, draw: Sampler) -> None:
    """Hang a pair of curtains at most windows, to the floor or to just below the sill."""
    plan = layout.plan
    for hole in plan.windows:
        space = hole.spaces[0]
        if plan.spaces[space].kind in ("bathroom", "kitchen") or draw.chance(0.3):
            continue
        long = decor.curtain(draw, draw.size(0.3, 0.45), hole.top + 0.06)
        short = decor.curtain(draw, draw.size(0.3, 0.45), hole.top - hole.sill + 0.2)
        yaw_deg = facing_yaw_deg(hole, plan, space)
        for model in (long, short) if draw.chance(0.6) else (short,):
            out, hung = hole.width / 2 + float(model.upper[0]) - 0.16, []
            for side in (-1, 1):  # left and right of the window, the rod above it
                x, y, _ = rotation("z", yaw_deg) @ (side * out, -HALF_WALL_M - 0.14, 0.0)
                z = hole.top + 0.15 - float(model.upper[2])
                at = (hole.centre[0] + x, hole.centre[1] + y, z)
                curtain = place(model, at, yaw_deg, space)
                hung.append(layout.add([curtain], ignoring=layout.window_boxes))
            if all(hung):
                break
