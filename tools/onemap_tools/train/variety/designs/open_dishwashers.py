"""Dishwashers with the door folded down."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, Vec, box, lathe, rod, rounded_box
from onemap_simulator.generation.model import Model, Part, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import grip, rubber, shell, tilted
from onemap_tools.train.variety.designs.dishwasher_parts import (
    CATEGORY,
    DEPTH_M,
    FRONT_Y,
    TOP_M,
    controls,
    top_surface,
    worktop,
)


def _rack(width: float, depth: float, tall: float, at: Vec) -> list[Mesh]:
    """A wire basket with rows of plate pins."""
    meshes: list[Mesh] = []
    for z in (0.0, tall):
        loop = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        points = [(x * width / 2, y * depth / 2, z) for x, y in loop]
        meshes += [
            rod(a, b, 0.005, 5) for a, b in zip(points, points[1:] + points[:1], strict=True)
        ]
    for x in np.linspace(-width / 2, width / 2, 8):
        meshes.append(rod((float(x), -depth / 2, 0), (float(x), depth / 2, 0), 0.003, 5))
        for y in (-depth / 2, depth / 2):
            meshes.append(rod((float(x), y, 0), (float(x), y, tall), 0.003, 5))
    return [m.translated(*at) for m in meshes]


def half_open(sampler: Sampler) -> Model:
    """The door folded half or wholly down: racks with plates, cups and a cutlery basket."""
    width, y, low = sampler.size(0.54, 0.61), FRONT_Y, 0.1
    top, wall = TOP_M - 0.045, 0.025
    casing = shell((-width / 2, y + 0.045, low), (width / 2, DEPTH_M / 2, top), wall)
    inside = width - 2 * wall - 0.04
    wires, crockery = [], []
    pulled = sampler.choice([0.0, 0.0, 0.16])
    for z, shift in ((low + 0.1, pulled), (low + 0.42, 0.0)):
        wires += _rack(inside, 0.44, 0.1, (0, 0.04 - shift, z))
        if z < 0.4:
            plate = lathe([(0.05, 0), (0.11, 0.012), (0.1, 0.014), (0.05, 0.006)], segments=14)
            for x in np.arange(-inside / 2 + 0.05, inside / 2 - 0.1, sampler.uniform(0.035, 0.06)):
                upright = plate.rotated("y", 84).translated(float(x), 0.08 - shift, z + 0.115)
                crockery.append(upright)
            basket = box((0.09, 0.2, 0.12), (inside / 2 - 0.06, 0.02 - shift, z + 0.006))
            wires.append(basket)
        else:
            for x in np.linspace(-1, 1, sampler.integer(3, 5)) * (inside / 2 - 0.05):
                for deep in (-0.1, 0.06, 0.16):
                    if sampler.chance(0.8):
                        cup = lathe([(0.038, 0), (0.03, 0.085), (0.0, 0.086)], segments=10)
                        crockery.append(cup.translated(float(x), deep, z + 0.006))
    tall = top - low - 0.006
    leaf = [rounded_box((width - 0.006, 0.04, tall), (0, y + 0.02, low), 0.008)]
    lining = [rounded_box((width - 0.06, 0.012, tall - 0.06), (0, y + 0.044, low + 0.03), 0.005)]
    lining.append(box((0.12, 0.02, 0.09), (width * 0.1, y + 0.05, low + tall * 0.5)))
    hands = grip(sampler, width * 0.7, (0, y, low + tall - 0.12), False)
    buttons, screen = controls(sampler, width, y, low + tall - 0.05)
    angle = sampler.choice([18.0, 35.0, 60.0, 86.0])
    leaf, lining, hands, buttons, screen = (
        tilted(part, angle, (y + 0.045, low)) for part in (leaf, lining, hands, buttons, screen)
    )
    kick = [box((width - 0.02, DEPTH_M - 0.12, low), (0, 0.05, 0))]
    model = assemble(
        CATEGORY,
        (sampler.enamel(), casing + leaf),
        (sampler.metal(), lining),
        (sampler.plastic(), wires),
        (sampler.ceramic(), crockery),
        (sampler.metal(), hands + buttons),
        (sampler.dark(), screen),
        (rubber(sampler), kick),
        (sampler.wood(), worktop(sampler, width)),
        support_surfaces=top_surface(width),
    )
    return _shifted(model)


def _shifted(model: Model) -> Model:
    """The model and its surface moved so that the bounding box is centred in depth."""
    y = -float((model.lower + model.upper)[1]) / 2
    parts = tuple(Part(p.mesh.translated(0, y), p.material) for p in model.parts)
    surfaces = tuple(
        s._replace(y_min=s.y_min + y, y_max=s.y_max + y) for s in model.support_surfaces
    )
    return Model(model.category, parts, surfaces)
