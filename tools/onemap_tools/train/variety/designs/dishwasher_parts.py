"""Parts that dishwashers share: controls, worktop."""

from __future__ import annotations

from onemap_simulator.generation.mesh import Mesh, box
from onemap_simulator.generation.model import SupportSurface
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import disc

CATEGORY = "dishwasher"
TOP_M = 0.9
DEPTH_M = 0.6
FRONT_Y = -DEPTH_M / 2


def top_surface(width: float, height: float = TOP_M) -> tuple[SupportSurface, ...]:
    """Where things stand on the worktop."""
    return (SupportSurface(-width / 2, -0.2, width / 2, 0.26, height),)


def controls(sampler: Sampler, width: float, y: float, z: float) -> tuple[list[Mesh], list[Mesh]]:
    """Buttons or a dial, and a small screen, on a strip whose middle height is z."""
    buttons: list[Mesh] = []
    count, pitch = sampler.integer(3, 7), sampler.uniform(0.026, 0.04)
    for index in range(count):
        x = width * 0.42 - index * pitch
        if sampler.chance(0.5):
            buttons.append(disc(0.009, 0.01, (x, y + 0.002, z), 8))
        else:
            buttons.append(box((0.02, 0.012, 0.012), (x, y - 0.002, z - 0.006)))
    if sampler.chance(0.4):
        buttons.append(disc(0.027, 0.028, (-width * 0.1, y + 0.002, z), 14))
    screen = [
        box((sampler.uniform(0.06, 0.13), 0.008, 0.035), (-width * 0.32, y - 0.001, z - 0.017))
    ]
    return buttons, screen


def worktop(sampler: Sampler, width: float) -> list[Mesh]:
    """A worktop of random thickness."""
    thick = sampler.uniform(0.025, 0.045)
    return [box((width, DEPTH_M + 0.02, thick), (0, 0, TOP_M - thick))]
