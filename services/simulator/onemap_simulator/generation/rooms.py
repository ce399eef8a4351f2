"""What stands in which room, and how."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from onemap_simulator.generation.clutter import hang, put
from onemap_simulator.generation.furniture.bathroom import (
    bathroom_sink,
    bathtub,
    shower,
    toilet,
    towel,
    washing_machine,
)
from onemap_simulator.generation.furniture.containers import (
    basket,
    cardboard_box,
    suitcase,
    trash_can,
)
from onemap_simulator.generation.furniture.electronics import (
    floor_lamp,
    laptop,
    radiator,
    standing_fan,
    table_lamp,
    television,
)
from onemap_simulator.generation.furniture.fittings import rug
from onemap_simulator.generation.furniture.plants import floor_plant, small_plant, vase
from onemap_simulator.generation.furniture.playthings import ball, bicycle, guitar, teddy_bear
from onemap_simulator.generation.furniture.seating import armchair, bench, chair, sofa, stool
from onemap_simulator.generation.furniture.sleep import bed, pillow
from onemap_simulator.generation.furniture.storage import (
    bookcase,
    dresser,
    nightstand,
    shelf,
    wardrobe,
)
from onemap_simulator.generation.furniture.tables import coffee_table, desk, table
from onemap_simulator.generation.furniture.tableware import book, bottle, bowl, cup
from onemap_simulator.generation.furniture.wall_decor import clock, mirror, picture
from onemap_simulator.generation.kitchen_row import kitchen_row
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.placement import Arranger
from onemap_simulator.generation.room_layout import Placed
from onemap_simulator.generation.sampler import Pick

Maker = Callable[[Pick], Model]


def furnish(room: Arranger) -> None:
    """Fill the room after its kind."""
    recipes = {
        "living room": _living_room,
        "kitchen": _kitchen,
        "bathroom": _bathroom,
        "bedroom": _bedroom,
        "study": _study,
        "dining room": _dining_room,
        "hallway": _hallway,
    }
    recipes[room.site.plan.spaces[room.space].kind](room)


def _along_walls(room: Arranger, *wishes: tuple[float, Maker]) -> list[Placed]:
    """Each wish, with its probability, somewhere against a wall if there is room."""
    placed = []
    for probability, make in wishes:
        if room.pick.chance(probability):
            thing = room.against_wall(make(room.pick))
            if thing is not None:
                placed.append(thing)
    return placed


def _dining_set(room: Arranger) -> Placed | None:
    """A table with chairs tucked under it, in the room if possible, else at a wall."""
    pick = room.pick
    seat = chair(pick)
    depth = float(np.ptp([seat.lower[1], seat.upper[1]]))
    for _ in range(3):
        model = table(pick)
        out = float(model.upper[1]) + depth / 2 - 0.14
        shifts = [-0.3, 0.3] if model.upper[0] > 0.72 else [0.0]
        around = [(seat, np.array([x, -out, 0.0]), 180.0) for x in shifts]
        around += [(seat, np.array([x, out, 0.0]), 0.0) for x in shifts]
        for companions in (around, around[: len(shifts)]):
            group = room.in_middle(model, companions)
            if group is not None:
                put(room, [group[0]], [(0.6, bowl), (0.6, bottle), (0.6, cup), (0.5, vase)])
                return group[0]
    return None


def _sofa_corner(room: Arranger) -> None:
    """A sofa with cushions, a coffee table and a rug in front, a television opposite."""
    pick = room.pick
    couch = room.against_wall(sofa(pick)) or room.against_wall(sofa(pick))
    couch = couch or room.against_wall(armchair(pick))
    if couch is None:
        return
    reach = float(couch.model.lower[1])
    low = coffee_table(pick)
    gap = pick.between(0.4, 0.7)
    at = np.array([0.0, reach - gap - low.upper[1], 0.0])
    stand = room.near(couch, low, at, 0.0)
    if stand is not None:
        put(room, [stand], [(0.7, book), (0.5, cup), (0.3, bowl), (0.3, vase)])
    carpet = rug(pick, pick.size(1.6, 2.4), pick.size(1.1, 1.6))
    room.near(couch, carpet, np.array([0.0, reach - 0.6, 0.0]), 0.0)
    put(room, [couch], [(0.7, pillow), (0.5, pillow), (0.4, teddy_bear)])


def _television(room: Arranger) -> None:
    pick = room.pick
    if pick.chance(0.5):
        stand = room.against_wall(dresser(pick))
        model = television(pick, hanging=False)
        if stand is not None and room.on_top(model, stand, turn=0.0) is not None:
            return
    room.against_wall(television(pick, hanging=True), z=pick.between(0.85, 1.0))


def _living_room(room: Arranger) -> None:
    pick = room.pick
    _sofa_corner(room)
    _television(room)
    _along_walls(room, (0.8, bookcase), (0.6, armchair), (0.7, radiator))
    kinds = [space.kind for space in room.site.plan.spaces]
    if "dining room" not in kinds or pick.chance(0.3):
        _dining_set(room)
    for make in (floor_lamp, floor_plant):
        if pick.chance(0.75):
            room.in_corner(make(pick))
    tops = _along_walls(room, (0.5, shelf), (0.4, dresser))
    put(room, tops, [(0.6, small_plant), (0.6, vase), (0.5, book), (0.4, table_lamp)])
    _along_walls(room, (0.4, guitar), (0.3, basket), (0.3, standing_fan))
    hang(room, [(0.9, picture), (0.5, picture), (0.5, clock)])


def _kitchen(room: Arranger) -> None:
    kitchen_row(room)
    _along_walls(room, (0.6, trash_can), (0.6, radiator), (0.5, stool), (0.3, shelf))
    _dining_set(room)
    hang(room, [(0.8, clock), (0.3, picture), (0.4, towel)])


def _bathroom(room: Arranger) -> None:
    pick = room.pick
    wet = [bathtub, shower] if pick.chance(0.5) else [shower, bathtub]
    washed = False
    for make in wet:
        if not washed or pick.chance(0.8):
            model = make(pick)
            washed = bool(room.in_corner(model) or room.against_wall(model)) or washed
    _along_walls(room, (1.0, toilet))
    basin = room.against_wall(bathroom_sink(pick))
    if basin is not None:
        glass = mirror(pick)
        back = float(basin.model.upper[1])
        room.near(basin, glass, np.array([0.0, back, 1.1]), 0.0)
    machines = _along_walls(room, (0.6, washing_machine), (0.5, radiator))
    put(room, [m for m in machines if m.model.tops], [(0.4, basket), (0.4, bottle)])
    hang(room, [(0.9, towel), (0.5, towel), (0.2 if basin else 0.8, mirror)])
    _along_walls(room, (0.6, basket), (0.6, trash_can), (0.4, shelf))


def _bedroom(room: Arranger) -> None:
    pick = room.pick
    for _ in range(3):
        model = bed(pick)
        rest = room.against_wall(model)
        if rest is not None:
            _bedside(room, rest)
            break
    _along_walls(room, (0.95, wardrobe))
    chest = _along_walls(room, (0.8, dresser))
    small: list[tuple[float, Maker]] = [(0.5, small_plant), (0.5, vase), (0.5, book)]
    put(room, chest, [*small, (0.3, lambda p: television(p, hanging=False)), (0.4, teddy_bear)])
    _along_walls(room, (0.7, radiator), (0.4, armchair), (0.3, bench), (0.4, suitcase))
    _along_walls(room, (0.3, floor_lamp), (0.4, standing_fan), (0.4, guitar), (0.3, basket))
    if pick.chance(0.6):
        room.on_floor(rug(pick, pick.size(1.2, 1.8), pick.size(0.8, 1.2)))
    for make in (ball, teddy_bear, cardboard_box):
        if pick.chance(0.35):
            room.on_floor(make(pick))
    hang(room, [(0.8, picture), (0.5, mirror), (0.3, clock)])


def _bedside(room: Arranger, rest: Placed) -> None:
    """Pillows on the bed and a nightstand with a lamp on each free side."""
    pick = room.pick
    wide = rest.model.upper[0] > 0.6
    head = pillow(pick)
    top = rest.model.tops[0]
    for x in (-0.36, 0.36) if wide else (0.0,):
        at = np.array([x, (top.y_min + top.y_max) / 2, top.z])
        room.near(rest, head, at, 0.0)
    stand = nightstand(pick)
    for side in (-1, 1):
        x = side * (float(rest.model.upper[0]) + float(stand.upper[0]) + 0.04)
        y = float(rest.model.upper[1] - stand.upper[1])
        placed = room.near(rest, stand, np.array([x, y, 0.0]), 0.0)
        if placed is not None:
            put(room, [placed], [(0.7, table_lamp), (0.4, book), (0.4, cup)])


def _study(room: Arranger) -> None:
    pick = room.pick
    work = room.against_wall(desk(pick))
    if work is not None:
        seat = chair(pick)
        out = work.model.lower[1] - seat.upper[1] + 0.12
        room.near(work, seat, np.array([0.0, out, 0.0]), 180.0)
        put(room, [work], [(0.95, laptop), (0.6, table_lamp), (0.5, book), (0.5, cup)])
    tops = _along_walls(room, (0.9, bookcase), (0.5, bookcase), (0.7, shelf), (0.4, dresser))
    put(room, tops, [(0.6, small_plant), (0.6, book), (0.4, vase), (0.3, bottle)])
    _along_walls(room, (0.3, bicycle), (0.5, radiator), (0.5, armchair), (0.5, guitar))
    _along_walls(room, (0.5, trash_can), (0.5, cardboard_box), (0.5, floor_plant))
    if pick.chance(0.5):
        room.on_floor(rug(pick, pick.size(1.2, 1.8), pick.size(0.8, 1.2)))
    hang(room, [(0.8, picture), (0.6, clock)])


def _dining_room(room: Arranger) -> None:
    _dining_set(room)
    tops = _along_walls(room, (0.8, dresser), (0.4, shelf), (0.4, bench))
    put(room, tops, [(0.7, vase), (0.6, bowl), (0.6, bottle), (0.5, small_plant), (0.4, cup)])
    _along_walls(room, (0.6, radiator), (0.6, floor_plant), (0.4, floor_lamp), (0.3, stool))
    hang(room, [(0.8, picture), (0.5, picture), (0.5, clock)])


def _hallway(room: Arranger) -> None:
    _along_walls(room, (0.6, bicycle))
    tops = _along_walls(room, (0.5, dresser), (0.3, bench), (0.4, shelf))
    put(room, tops, [(0.5, vase), (0.5, basket), (0.4, table_lamp), (0.4, small_plant)])
    _along_walls(room, (0.4, suitcase), (0.3, cardboard_box), (0.3, basket))
    hang(room, [(0.6, mirror), (0.7, picture), (0.3, clock)])
