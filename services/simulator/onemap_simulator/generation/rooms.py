"""The furniture of each kind of room, and how it is arranged."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.clutter import hang_on_walls, place_on
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
from onemap_simulator.generation.placement import Placer
from onemap_simulator.generation.room_layout import PlacedModel
from onemap_simulator.generation.sampler import ModelFactory


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


def _along_walls(placer: Placer, *candidates: tuple[float, ModelFactory]) -> list[PlacedModel]:
    """Place each candidate, with its probability, against a wall where it fits."""
    placed = []
    for probability, make in candidates:
        if placer.sampler.chance(probability):
            item = placer.against_wall(make(placer.sampler))
            if item is not None:
                placed.append(item)
    return placed


def _dining_set(placer: Placer) -> PlacedModel | None:
    """A table with chairs tucked under it, in the room if possible, else at a wall."""
    sampler = placer.sampler
    seat = chair(sampler)
    depth = float(np.ptp([seat.lower[1], seat.upper[1]]))
    for _ in range(3):
        model = table(sampler)
        out = float(model.upper[1]) + depth / 2 - 0.14
        shifts = [-0.3, 0.3] if model.upper[0] > 0.72 else [0.0]
        around = [(seat, np.array([x, -out, 0.0]), 180.0) for x in shifts]
        around += [(seat, np.array([x, out, 0.0]), 0.0) for x in shifts]
        for companions in (around, around[: len(shifts)]):
            group = placer.in_middle(model, companions)
            if group is not None:
                place_on(placer, [group[0]], [(0.6, bowl), (0.6, bottle), (0.6, cup), (0.5, vase)])
                return group[0]
    return None


def _sofa_corner(placer: Placer) -> None:
    """A sofa with cushions, a coffee table and a rug in front, a television opposite."""
    sampler = placer.sampler
    couch = placer.against_wall(sofa(sampler)) or placer.against_wall(sofa(sampler))
    couch = couch or placer.against_wall(armchair(sampler))
    if couch is None:
        return
    reach = float(couch.model.lower[1])
    low = coffee_table(sampler)
    gap = sampler.uniform(0.4, 0.7)
    at = np.array([0.0, reach - gap - low.upper[1], 0.0])
    stand = placer.near(couch, low, at, 0.0)
    if stand is not None:
        place_on(placer, [stand], [(0.7, book), (0.5, cup), (0.3, bowl), (0.3, vase)])
    carpet = rug(sampler, sampler.size(1.6, 2.4), sampler.size(1.1, 1.6))
    placer.near(couch, carpet, np.array([0.0, reach - 0.6, 0.0]), 0.0)
    place_on(placer, [couch], [(0.7, pillow), (0.5, pillow), (0.4, teddy_bear)])


def _television(placer: Placer) -> None:
    sampler = placer.sampler
    if sampler.chance(0.5):
        stand = placer.against_wall(dresser(sampler))
        model = television(sampler, hanging=False)
        if stand is not None and placer.on_top(model, stand, yaw_deg=0.0) is not None:
            return
    placer.against_wall(television(sampler, hanging=True), z=sampler.uniform(0.85, 1.0))


def _living_room(placer: Placer) -> None:
    sampler = placer.sampler
    _sofa_corner(placer)
    _television(placer)
    _along_walls(placer, (0.8, bookcase), (0.6, armchair), (0.7, radiator))
    kinds = [space.kind for space in placer.layout.plan.spaces]
    if "dining room" not in kinds or sampler.chance(0.3):
        _dining_set(placer)
    for make in (floor_lamp, floor_plant):
        if sampler.chance(0.75):
            placer.in_corner(make(sampler))
    supports = _along_walls(placer, (0.5, shelf), (0.4, dresser))
    place_on(placer, supports, [(0.6, small_plant), (0.6, vase), (0.5, book), (0.4, table_lamp)])
    _along_walls(placer, (0.4, guitar), (0.3, basket), (0.3, standing_fan))
    hang_on_walls(placer, [(0.9, picture), (0.5, picture), (0.5, clock)])


def _kitchen(placer: Placer) -> None:
    kitchen_row(placer)
    _along_walls(placer, (0.6, trash_can), (0.6, radiator), (0.5, stool), (0.3, shelf))
    _dining_set(placer)
    hang_on_walls(placer, [(0.8, clock), (0.3, picture), (0.4, towel)])


def _bathroom(placer: Placer) -> None:
    sampler = placer.sampler
    wet = [bathtub, shower] if sampler.chance(0.5) else [shower, bathtub]
    washed = False
    for make in wet:
        if not washed or sampler.chance(0.8):
            model = make(sampler)
            washed = bool(placer.in_corner(model) or placer.against_wall(model)) or washed
    _along_walls(placer, (1.0, toilet))
    basin = placer.against_wall(bathroom_sink(sampler))
    if basin is not None:
        glass = mirror(sampler)
        back = float(basin.model.upper[1])
        placer.near(basin, glass, np.array([0.0, back, 1.1]), 0.0)
    machines = _along_walls(placer, (0.6, washing_machine), (0.5, radiator))
    place_on(
        placer, [m for m in machines if m.model.support_surfaces], [(0.4, basket), (0.4, bottle)]
    )
    hang_on_walls(placer, [(0.9, towel), (0.5, towel), (0.2 if basin else 0.8, mirror)])
    _along_walls(placer, (0.6, basket), (0.6, trash_can), (0.4, shelf))


def _bedroom(placer: Placer) -> None:
    sampler = placer.sampler
    for _ in range(3):
        model = bed(sampler)
        rest = placer.against_wall(model)
        if rest is not None:
            _bedside(placer, rest)
            break
    _along_walls(placer, (0.95, wardrobe))
    chest = _along_walls(placer, (0.8, dresser))
    small: list[tuple[float, ModelFactory]] = [(0.5, small_plant), (0.5, vase), (0.5, book)]
    place_on(
        placer, chest, [*small, (0.3, lambda p: television(p, hanging=False)), (0.4, teddy_bear)]
    )
    _along_walls(placer, (0.7, radiator), (0.4, armchair), (0.3, bench), (0.4, suitcase))
    _along_walls(placer, (0.3, floor_lamp), (0.4, standing_fan), (0.4, guitar), (0.3, basket))
    if sampler.chance(0.6):
        placer.on_floor(rug(sampler, sampler.size(1.2, 1.8), sampler.size(0.8, 1.2)))
    for make in (ball, teddy_bear, cardboard_box):
        if sampler.chance(0.35):
            placer.on_floor(make(sampler))
    hang_on_walls(placer, [(0.8, picture), (0.5, mirror), (0.3, clock)])


def _bedside(placer: Placer, rest: PlacedModel) -> None:
    """Pillows on the bed and a nightstand with a lamp on each free side."""
    sampler = placer.sampler
    wide = rest.model.upper[0] > 0.6
    head = pillow(sampler)
    top = rest.model.support_surfaces[0]
    for x in (-0.36, 0.36) if wide else (0.0,):
        at = np.array([x, (top.y_min + top.y_max) / 2, top.z])
        placer.near(rest, head, at, 0.0)
    stand = nightstand(sampler)
    for side in (-1, 1):
        x = side * (float(rest.model.upper[0]) + float(stand.upper[0]) + 0.04)
        y = float(rest.model.upper[1] - stand.upper[1])
        placed = placer.near(rest, stand, np.array([x, y, 0.0]), 0.0)
        if placed is not None:
            place_on(placer, [placed], [(0.7, table_lamp), (0.4, book), (0.4, cup)])


def _study(placer: Placer) -> None:
    sampler = placer.sampler
    work = placer.against_wall(desk(sampler))
    if work is not None:
        seat = chair(sampler)
        out = work.model.lower[1] - seat.upper[1] + 0.12
        placer.near(work, seat, np.array([0.0, out, 0.0]), 180.0)
        place_on(placer, [work], [(0.95, laptop), (0.6, table_lamp), (0.5, book), (0.5, cup)])
    supports = _along_walls(placer, (0.9, bookcase), (0.5, bookcase), (0.7, shelf), (0.4, dresser))
    place_on(placer, supports, [(0.6, small_plant), (0.6, book), (0.4, vase), (0.3, bottle)])
    _along_walls(placer, (0.3, bicycle), (0.5, radiator), (0.5, armchair), (0.5, guitar))
    _along_walls(placer, (0.5, trash_can), (0.5, cardboard_box), (0.5, floor_plant))
    if sampler.chance(0.5):
        placer.on_floor(rug(sampler, sampler.size(1.2, 1.8), sampler.size(0.8, 1.2)))
    hang_on_walls(placer, [(0.8, picture), (0.6, clock)])


def _dining_room(placer: Placer) -> None:
    _dining_set(placer)
    supports = _along_walls(placer, (0.8, dresser), (0.4, shelf), (0.4, bench))
    place_on(
        placer, supports, [(0.7, vase), (0.6, bowl), (0.6, bottle), (0.5, small_plant), (0.4, cup)]
    )
    _along_walls(placer, (0.6, radiator), (0.6, floor_plant), (0.4, floor_lamp), (0.3, stool))
    hang_on_walls(placer, [(0.8, picture), (0.5, picture), (0.5, clock)])


def _hallway(placer: Placer) -> None:
    _along_walls(placer, (0.6, bicycle))
    supports = _along_walls(placer, (0.5, dresser), (0.3, bench), (0.4, shelf))
    place_on(placer, supports, [(0.5, vase), (0.5, basket), (0.4, table_lamp), (0.4, small_plant)])
    _along_walls(placer, (0.4, suitcase), (0.3, cardboard_box), (0.3, basket))
    hang_on_walls(placer, [(0.6, mirror), (0.7, picture), (0.3, clock)])
