"""Washbasins without a cabinet: on a column, or hung at the wall."""

from __future__ import annotations

from onemap_simulator.generation.mesh import Mesh, box, cylinder, lathe, rod, tube
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.basin_parts import Size, basin_slab, siphon
from onemap_tools.train.variety.designs.sanitary import SQUARE, faucet, ring, skin, stand


def pedestal(sampler: Sampler) -> Model:
    """A basin with a ledge on a column: fluted and round, art deco or plain."""
    width, depth, height = sampler.size(0.48, 0.72), sampler.size(0.4, 0.54), sampler.size(0.8, 0.9)
    deep, power = sampler.size(0.14, 0.2), sampler.choice((2.0, 2.6, 5.0, SQUARE))
    low = height - deep
    hole, hole_power = (width * 0.78, depth * 0.62), min(power, 3.0)
    shift = (0.0, -depth * 0.07, 0.0)
    rings = [
        ring((width * s, depth * s), z, power, 9.0)
        for s, z in (
            (0.5, low),
            (0.86, low + deep * 0.5),
            (0.98, height - 0.05),
            (1.0, height - 0.04),
            (1.0, height),
        )
    ]
    rings += [
        ring((hole[0] * s, hole[1] * s), height - d, hole_power) + shift
        for s, d in ((1.0, 0.0), (0.85, deep * 0.5), (0.3, deep * 0.75))
    ]
    basin = [skin(rings)]
    if sampler.chance(0.5):
        basin.append(box((width, 0.02, 0.08), (0, depth / 2 - 0.01, height - 0.01)))
    foot, waist = sampler.uniform(0.1, 0.15), sampler.uniform(0.065, 0.1)
    turned = [
        (foot, 0.0),
        (foot, 0.04),
        (foot * 0.8, 0.08),
        (waist, 0.2),
        (waist, 0.6),
        (0.13, low + 0.03),
    ]
    if sampler.chance(0.35):
        turned = [(foot, 0.0), (foot * 0.95, 0.1), (foot * 0.9, low + 0.03)]
    sides = sampler.choice((8, 12, 18))
    column = lathe(turned, (0, depth * 0.1, 0), sides).rotated("z", 180 / sides)
    tap = faucet(sampler, (0, depth / 2 - 0.055, height))
    return stand("sink", (sampler.ceramic(), [*basin, column]), (sampler.metal(), tap))


def _hung_bowl(size: Size, height: float, tall: float, power: float) -> Mesh:
    """A basin of height ``tall`` with its rim at ``height``: a block, or round below."""
    width, depth = size
    if power == SQUARE:
        return basin_slab(
            (width, depth), (width - 0.1, depth * 0.66), (height - tall, height), tall - 0.03, 5.0
        )
    rings = [
        ring((width * s, depth * s), z, power, 9.0)
        for s, z in ((0.55, height - tall), (0.95, height - tall * 0.4), (1.0, height))
    ]
    rings += [
        ring((size[0] * s, size[1] * s * 0.84), height - d, power) + (0, -depth * 0.05, 0)
        for s, d in ((0.86, 0.0), (0.7, tall * 0.5), (0.3, tall * 0.75))
    ]
    return skin(rings)


def wall_hung(sampler: Sampler) -> Model:
    """A bare basin at the wall: below it only a siphon, pipes and at times two thin legs."""
    width, depth, height = (
        sampler.size(0.42, 0.75),
        sampler.size(0.34, 0.5),
        sampler.size(0.8, 0.88),
    )
    tall, y = sampler.size(0.11, 0.2), depth / 2
    power = sampler.choice((2.0, 3.0, SQUARE))
    body = _hung_bowl((width, depth), height, tall, power)
    pipes = siphon((0, -0.01), height - tall, True, y)
    for x in (-0.1, 0.1):
        pipes.append(
            tube(
                [(x, y - 0.06, height - tall * 0.5), (x, y - 0.05, 0.5), (x, y - 0.02, 0.42)], 0.007
            )
        )
        pipes.append(
            cylinder(0.018, 0.05, segments=8).rotated("x", 90).translated(x, y - 0.0, 0.42)
        )
    if sampler.chance(0.5):
        for x in (-width / 2 + 0.05, width / 2 - 0.05):
            pipes += [rod((x, -depth * 0.36, 0), (x, -depth * 0.3, height - tall * 0.4), 0.014)]
            pipes += [cylinder(0.025, 0.015, (x, -depth * 0.36, 0), 8)]
        pipes.append(
            rod(
                (-width / 2 + 0.05, -depth * 0.33, 0.45),
                (width / 2 - 0.05, -depth * 0.33, 0.45),
                0.01,
            )
        )
    back = [box((width * 0.95, 0.02, sampler.uniform(0.1, 0.4)), (0, y + 0.008, height - 0.05))]
    tap = faucet(sampler, (0, y - 0.05, height))
    return stand(
        "sink",
        (sampler.ceramic(), [body]),
        (sampler.material("tiles", 0.3, sampler.colour()), back if sampler.chance(0.3) else []),
        (sampler.metal(), tap),
        (sampler.metal(), pipes),
    )
