"""A kitchen's row of appliances and cabinets, cabinets above, small objects on top."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.clutter import place_on
from onemap_simulator.generation.furniture.appliances import (
    dishwasher,
    kettle,
    microwave,
    oven,
    refrigerator,
    toaster,
)
from onemap_simulator.generation.furniture.bathroom import washing_machine
from onemap_simulator.generation.furniture.kitchen import (
    DEPTH_M,
    KitchenLook,
    kitchen_cabinet,
    kitchen_look,
    kitchen_sink,
    wall_cabinet,
)
from onemap_simulator.generation.furniture.tableware import bottle, bowl, cup
from onemap_simulator.generation.placement import Placer
from onemap_simulator.generation.room_layout import PlacedModel


def kitchen_row(placer: Placer) -> None:
    """Sink, oven, dishwasher, cabinets and refrigerator in one row, or in two if it is too long."""
    sampler = placer.sampler
    look = kitchen_look(sampler)
    units = [
        kitchen_sink(sampler, sampler.size(0.6, 0.8), look),
        oven(sampler),
        dishwasher(sampler, look[1]),
        kitchen_cabinet(sampler, sampler.size(0.5, 0.8), look),
        kitchen_cabinet(sampler, sampler.size(0.4, 0.6), look),
    ]
    units = [units[index] for index in sampler.rng.permutation(len(units))]
    fridge = refrigerator(sampler)
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
    if sampler.chance(0.3):
        placer.against_wall(washing_machine(sampler))
    _above(placer, placed, look)
    supports = [item for item in placed if item.model.support_surfaces]
    place_on(placer, supports, [(0.85, microwave), (0.9, kettle), (0.85, toaster)])
    place_on(placer, supports, [(0.6, bottle), (0.5, bowl), (0.5, cup)])


def _above(placer: Placer, row: list[PlacedModel], look: KitchenLook) -> None:
    """Cabinets on the wall above base units."""
    for item in row:
        width = float(np.ptp([item.model.lower[0], item.model.upper[0]]))
        if item.model.support_surfaces and placer.sampler.chance(0.75):
            model = wall_cabinet(placer.sampler, width, look)
            offset = np.array([0.0, DEPTH_M / 2 - float(model.upper[1]), 1.42])
            placer.near(item, model, offset, 0.0)
