"""Parts that microwaves share: sizes, vents, windows."""

from __future__ import annotations

from onemap_simulator.generation.mesh import Mesh, box
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import round_rect, slab

CATEGORY = "microwave"
Sides = tuple[float, float, float]


def sizes(sampler: Sampler) -> Sides:
    """Width, depth and height of a free-standing one."""
    return sampler.size(0.42, 0.56), sampler.size(0.3, 0.42), sampler.size(0.25, 0.33)


def side_vents(sampler: Sampler, width: float, depth: float, height: float) -> list[Mesh]:
    """Slots in one side, low at the front or high at the back."""
    x, y = sampler.choice([-1, 1]) * width / 2, sampler.uniform(-0.06, 0.06) * depth
    return [
        box((0.006, 0.01, height * 0.3), (x, y + (step - 3) * 0.02, height * 0.5))
        for step in range(7)
    ]


def door_window(sampler: Sampler, wide: float, tall: float, at: Sides) -> list[Mesh]:
    """A door's window, square or rounded; ``at`` is the middle of its lower edge."""
    corner = sampler.choice([0.002, 0.02, min(wide, tall) * 0.3])
    return [slab(round_rect(wide, tall, corner, corner), 0.006, at)]
