"""Toilets whose tank is in a wall, a ledge or a cabinet behind them."""

from __future__ import annotations

from onemap_simulator.generation.mesh import box, cylinder, rounded_box, torus
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.sanitary import stand
from onemap_tools.train.variety.designs.toilet_parts import (
    draw_pan,
    hollow_bowl,
    seat_and_cover,
    seat_material,
)


def wall_hung(sampler: Sampler) -> Model:
    """A bowl that hangs in front of a slim panel or a boxed-in ledge with a flush plate."""
    pan, ceramic = draw_pan(sampler, sampler.choice((2.0, 2.3, 3.0))), sampler.ceramic()
    low = sampler.uniform(0.06, 0.14)
    bowl = hollow_bowl(pan, sampler.uniform(0.45, 0.7), low, 0.12)
    depth, y = sampler.size(0.1, 0.2), pan.length / 2 + 0.06
    neck = rounded_box((pan.width * 0.75, 0.2, 0.26), (0, y - 0.1, pan.height - 0.275), 0.04)
    width, height = sampler.size(0.48, 0.8), sampler.size(0.95, 1.2)
    wall = [box((width, depth, height), (0, y + depth / 2, 0))]
    shelf = [box((width + 0.03, depth + 0.03, 0.025), (0, y + depth / 2 - 0.01, height))]
    panel_z = height - sampler.uniform(0.15, 0.22)
    plate = [box((0.24, 0.012, 0.16), (0, y - 0.006, panel_z - 0.08))]
    buttons = [box((0.07, 0.01, 0.09), (x, y - 0.014, panel_z - 0.045)) for x in (-0.05, 0.05)]
    if sampler.chance(0.4):
        buttons = [
            cylinder(0.035, 0.012, segments=12).rotated("x", 90).translated(x, y - 0.01, panel_z)
            for x in (-0.05, 0.05)
        ]
    tiled = sampler.chance(0.5)
    front = sampler.material("tiles", 0.5, sampler.colour()) if tiled else sampler.enamel()
    seat = seat_and_cover(sampler, pan, sampler.choice(("closed", "closed", "open")))
    return stand(
        "toilet",
        (ceramic, [bowl, neck]),
        (seat_material(sampler, ceramic), seat),
        (front, wall),
        (sampler.wood() if sampler.chance(0.4) else sampler.ceramic(), shelf if tiled else []),
        (sampler.metal(), plate),
        (sampler.plastic(), buttons),
    )


def furniture_unit(sampler: Sampler) -> Model:
    """A back-to-wall bowl in front of a cabinet that hides its tank."""
    pan, ceramic = draw_pan(sampler, sampler.choice((2.0, 2.4, 6.0))), sampler.ceramic()
    bowl = hollow_bowl(pan, sampler.uniform(0.7, 0.95), 0.0, 0.05)
    y, deep = pan.length / 2 + 0.08, sampler.size(0.2, 0.3)
    neck = rounded_box((pan.width * 0.85, 0.26, pan.height), (0, y - 0.11, 0), 0.04)
    width, height = sampler.size(0.5, 0.7), sampler.size(0.8, 0.95)
    unit = [
        box((width, deep, height - 0.06), (0, y + deep / 2, 0.06)),
        box((width - 0.06, deep - 0.04, 0.06), (0, y + deep / 2 + 0.01, 0)),
    ]
    top = [box((width + 0.02, deep + 0.02, 0.03), (0, y + deep / 2, height))]
    grooves = [box((width - 0.02, 0.008, 0.24), (0, y - 0.004, z)) for z in (0.08, height - 0.27)]
    button = [
        torus(0.03, 0.008, (0.0, y + deep / 2, height + 0.034), 12),
        cylinder(0.026, 0.012, (0.0, y + deep / 2, height + 0.028), 12),
    ]
    state = sampler.choice(("closed", "open"))
    return stand(
        "toilet",
        (ceramic, [bowl, neck]),
        (seat_material(sampler, ceramic), seat_and_cover(sampler, pan, state)),
        (sampler.wood(), [*unit, *grooves]),
        (sampler.ceramic(), top),
        (sampler.metal(), button),
    )
