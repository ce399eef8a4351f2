"""Parts of radiators: their paint and their valves."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, cylinder, rod
from onemap_simulator.generation.model import Material
from onemap_simulator.generation.sampler import Sampler


def radiator_paint(sampler: Sampler) -> Material:
    """What a radiator is coated with."""
    kind = sampler.integer(0, 3)
    if kind < 2:
        return sampler.pale() if kind == 0 else sampler.enamel()
    return sampler.metal() if kind == 2 else sampler.plastic()


def valve(sampler: Sampler, x: float, z: float) -> tuple[list[Mesh], list[Mesh]]:
    """At the side x (its sign says which): a pipe from the floor, and a turning head."""
    side = float(np.sign(x))
    pipe = [
        cylinder(0.011, z, (x + side * 0.035, 0, 0), 8),
        rod((x, 0, z), (x + side * 0.04, 0, z), 0.012),
    ]
    pipe.append(cylinder(0.024, 0.01, (x + side * 0.035, 0, 0), 10))
    if sampler.chance(0.5):
        head = [cylinder(0.022, 0.07, (x + side * 0.035, 0, z), 10)]
    else:
        head = [
            cylinder(0.024, 0.07, segments=10)
            .rotated("y", side * 90)
            .translated(x + side * 0.035, 0, z)
        ]
    return pipe, head
