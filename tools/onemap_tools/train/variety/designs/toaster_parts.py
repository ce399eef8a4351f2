"""Parts that toasters share: slots, slices of bread, the lead."""

from __future__ import annotations

from onemap_simulator.generation.mesh import Mesh, box, tube
from onemap_simulator.generation.model import Material
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import extruded, round_rect

CATEGORY = "toaster"
Place = tuple[float, float, float]


def crust(sampler: Sampler) -> Material:
    """The brown of toasted bread."""
    return sampler.material("noise", 0.2, (0.78, 0.55, 0.28), (0.5, 0.3, 0.12))


def slice_of_bread(sampler: Sampler, wide: float, at: Place) -> Mesh:
    """A slice of bread that sticks out of a slot; its plane faces the front."""
    tall = sampler.uniform(0.06, 0.1)
    outline = round_rect(wide, tall, 0.006, wide * sampler.uniform(0.15, 0.4))
    bread = extruded(outline, 0.016)
    return bread.rotated("z", 90).translated(*at)


def lead(depth: float, x: float) -> Mesh:
    """A lead that leaves the back at x."""
    y = depth / 2
    return tube([(x, y - 0.01, 0.02), (x, y + 0.02, 0.006), (x + 0.06, y + 0.03, 0.006)], 0.0045, 5)


def bread_slots(
    sampler: Sampler, wide: float, at: list[tuple[float, float]], z: float
) -> tuple[list[Mesh], list[Mesh]]:
    """Dark slots sunk in a top at (x, y), and slices in some of them."""
    slots = [box((wide, 0.026, 0.012), (x, y, z - 0.008)) for x, y in at]
    bread: list[Mesh] = []
    if sampler.chance(0.5):
        count = max(1, round(wide / 0.13))
        for x, y in at:
            for index in range(count):
                if sampler.chance(0.8):
                    where = x + (index - (count - 1) / 2) * wide / count
                    bread.append(
                        slice_of_bread(sampler, min(0.11, wide / count * 0.9), (where, y, z - 0.03))
                    )
    return slots, bread
