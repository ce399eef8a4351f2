"""The row of a kitchen: appliances and cabinets side by side, cabinets above, things on top."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.clutter import put
from onemap_simulator.generation.furniture.appliances import (
    dishwasher,
    kettle,
    microwave,
    oven,
    refrigerator,
    toaster,
)
from onemap_simulator.generation.furniture.bathroom import washing_machine
from onemap_simulator.generation.furniture.catalogue import kitchen_look
from onemap_simulator.generation.furniture.kitchen import (
    DEPTH_M,
    kitchen_cabinet,
    kitchen_sink,
    wall_cabinet,
)
from onemap_simulator.generation.furniture.tableware import bottle, bowl, cup
from onemap_simulator.generation.model import Material
from onemap_simulator.generation.placement import Arranger
from onemap_simulator.generation.room_layout import Placed

Look = tuple[Material, Material, Material]


def kitchen_row(room: Arranger) -> None:
    """Sink, oven, dishwasher, cabinets and refrigerator in one row, or in two if it is too long."""
    pick = room.pick
    look = kitchen_look(pick)
    units = [
        kitchen_sink(pick, pick.size(0.6, 0.8), look),
        oven(pick),
        dishwasher(pick, look[1]),
        kitchen_cabinet(pick, pick.size(0.5, 0.8), look),
        kitchen_cabinet(pick, pick.size(0.4, 0.6), look),
    ]
    units = [units[index] for index in pick.rng.permutation(len(units))]
    fridge = refrigerator(pick)
    placed = room.in_row([*units, fridge]) or room.in_row([*units[:-1], fridge])
    if placed is None:
        placed = [*(room.in_row(units[:3]) or []), *(room.in_row(units[3:]) or [])]
        alone = room.in_corner(fridge)
        placed += [alone] if alone is not None else []
    have = {id(thing.model) for thing in placed}
    for model in (*units, fridge):
        if id(model) not in have:
            extra = room.against_wall(model)
            placed += [extra] if extra is not None else []
    if pick.chance(0.3):
        room.against_wall(washing_machine(pick))
    _above(room, placed, look)
    tops = [thing for thing in placed if thing.model.tops]
    put(room, tops, [(0.85, microwave), (0.9, kettle), (0.85, toaster)])
    put(room, tops, [(0.6, bottle), (0.5, bowl), (0.5, cup)])


def _above(room: Arranger, row: list[Placed], look: Look) -> None:
    """Cabinets on the wall above base units."""
    for thing in row:
        width = float(np.ptp([thing.model.lower[0], thing.model.upper[0]]))
        if thing.model.tops and room.pick.chance(0.75):
            model = wall_cabinet(room.pick, width, look)
            offset = np.array([0.0, DEPTH_M / 2 - float(model.upper[1]), 1.42])
            room.near(thing, model, offset, 0.0)
