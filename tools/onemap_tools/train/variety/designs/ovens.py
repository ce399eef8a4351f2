"""Ovens: cookers and ranges; and, from their own modules, other ovens and dishwashers."""

from __future__ import annotations

from onemap_simulator.generation.mesh import Mesh, box, cylinder, rod, rounded_box, torus
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.appliance_parts import grip, rubber, tilted
from onemap_tools.train.variety.designs.dishwashers import compact, integrated, striped
from onemap_tools.train.variety.designs.old_stoves import iron_range, retro_stove
from onemap_tools.train.variety.designs.open_dishwashers import half_open
from onemap_tools.train.variety.designs.oven_parts import (
    CATEGORY,
    DEPTH_M,
    FRONT_Y,
    TOP_M,
    control_knobs,
    gas_burners,
    oven_casing,
    oven_door,
    spread,
)
from onemap_tools.train.variety.designs.special_ovens import column, open_oven


def cooker(sampler: Sampler) -> Model:
    """A free-standing cooker: glass or plate hob, knobs, window door and a drawer below."""
    width, y = sampler.size(0.5, 0.62), FRONT_Y
    low, band = sampler.uniform(0.03, 0.09), sampler.uniform(0.09, 0.14)
    casing, dark = oven_casing(sampler, width, low)
    drawer = sampler.uniform(0.1, 0.22) if sampler.chance(0.75) else 0.0
    z, face = low + drawer, TOP_M - 0.035 - band
    fronts, glass = oven_door(sampler, width - 0.008, face - z - 0.008, (0, y, z))
    hands = grip(sampler, width * sampler.uniform(0.5, 0.9), (0, y, face - 0.055), False)
    if drawer:
        fronts.append(box((width - 0.008, 0.04, drawer - 0.012), (0, y + 0.025, low)))
        if sampler.chance(0.6):
            hands += grip(sampler, width * 0.4, (0, y + 0.006, z - 0.05), False)
    panel = box((width - 0.002, 0.05, band - 0.006), (0, y + 0.03, face + 0.003))
    count = sampler.integer(4, 7)
    xs = spread(count, width * 0.8)
    if sampler.chance(0.6):
        xs = xs[: count // 2] + xs[count // 2 + 1 :]
        glass.append(box((0.09, 0.014, 0.045), (0, y + 0.006, face + band / 2 - 0.022)))
    knobs = control_knobs(sampler, xs, y + 0.006, face + band / 2)
    plate = [rounded_box((width, DEPTH_M + 0.012, 0.035), (0, 0.0, TOP_M - 0.035), 0.006)]
    rings: list[Mesh] = []
    solid = sampler.chance(0.45)
    for x in (-0.13, 0.13):
        for deep in (-0.13, 0.12):
            radius = sampler.uniform(0.065, 0.095)
            if solid:
                rings.append(cylinder(radius, 0.016, (x, deep, TOP_M), 16))
            else:
                rings.append(torus(radius, 0.004, (x, deep, TOP_M), 16))
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing + fronts),
        (sampler.enamel(), [panel]),
        (sampler.dark(), plate),
        (sampler.dark(), glass),
        (sampler.metal(), hands + rings),
        (sampler.plastic(), knobs),
        (rubber(sampler), dark),
    )


def gas_range(sampler: Sampler) -> Model:
    """A gas range: grates over burners, a splashback or raised lid, a steel door with a bar."""
    width, y, low = sampler.size(0.52, 0.78), FRONT_Y, sampler.uniform(0.06, 0.14)
    casing, dark = oven_casing(sampler, width, low)
    face = TOP_M - sampler.uniform(0.1, 0.15)
    drawer = sampler.uniform(0.12, 0.2) if sampler.chance(0.5) else 0.0
    fronts, glass = oven_door(
        sampler, width - 0.008, face - low - drawer - 0.01, (0, y, low + drawer)
    )
    if drawer:
        fronts.append(rounded_box((width - 0.008, 0.045, drawer - 0.01), (0, y + 0.023, low), 0.01))
    panel = box((width, 0.07, TOP_M - 0.02 - face), (0, 0, 0)).rotated("x", -8)
    fronts.append(panel.translated(0, y + 0.03, face))
    knobs = control_knobs(
        sampler, spread(sampler.integer(4, 6), width * 0.8), y - 0.005, face + 0.06
    )
    hands = grip(sampler, width * 0.86, (0, y, face - 0.06), False)
    top = [box((width, DEPTH_M, 0.03), (0, 0, TOP_M - 0.03))]
    burners, grates = gas_burners(sampler, width - 0.04, 3 if width > 0.68 else 2)
    kind = sampler.integer(0, 2)
    back = DEPTH_M / 2
    if kind == 0:
        tall = sampler.uniform(0.08, 0.25)
        top.append(box((width, 0.05, tall), (0, back - 0.025, TOP_M)))
        dark.append(box((0.16, 0.01, min(tall, 0.08) * 0.6), (0, back - 0.052, TOP_M + tall * 0.4)))
    elif kind == 1:
        lid = box((width, 0.02, 0.5), (0, back - 0.03, TOP_M + 0.005))
        glass.append(tilted([lid], -4, (back, TOP_M))[0].translated(0, -0.012))
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing + fronts),
        (sampler.metal(), top),
        (sampler.dark(), grates),
        (sampler.dark(), glass),
        (sampler.metal(), hands + burners),
        (sampler.plastic(), knobs),
        (rubber(sampler), dark),
    )


def _towel_rail(width: float) -> list[Mesh]:
    """A rail along the front below the hob, on two posts."""
    rail = [
        rod(
            (-width * 0.48, FRONT_Y - 0.045, TOP_M - 0.045),
            (width * 0.48, FRONT_Y - 0.045, TOP_M - 0.045),
            0.009,
        )
    ]
    rail += [
        rod(
            (x * width, FRONT_Y + 0.01, TOP_M - 0.045),
            (x * width, FRONT_Y - 0.045, TOP_M - 0.045),
            0.008,
            6,
        )
        for x in (-0.46, 0.46)
    ]
    return rail


def range_cooker(sampler: Sampler) -> Model:
    """A broad cooker with two or more ovens side by side, many knobs, a rail and short legs."""
    width, y, low = sampler.size(0.76, 0.98), FRONT_Y, sampler.uniform(0.08, 0.14)
    casing, dark = oven_casing(sampler, width, low)
    face = TOP_M - sampler.uniform(0.12, 0.16)
    seam = width * sampler.choice([0.0, 0.1, 0.16])
    fronts: list[Mesh] = []
    glass: list[Mesh] = []
    hands: list[Mesh] = []
    for x0, x1 in ((-width / 2, seam), (seam, width / 2)):
        wide, x = x1 - x0 - 0.012, (x0 + x1) / 2
        cut = low + (face - low) * 0.45
        spans = [(low, cut), (cut, face)] if sampler.chance(0.4) else [(low, face)]
        for bottom, top in spans:
            tall = top - bottom - 0.01
            if sampler.chance(0.6):
                leaf, window = oven_door(sampler, wide, tall, (x, y, bottom))
                glass += window
            else:
                leaf = [rounded_box((wide, 0.045, tall), (x, y + 0.022, bottom), 0.012)]
                inner = (wide * 0.8, 0.02, tall * 0.66)
                leaf.append(rounded_box(inner, (x, y + 0.002, bottom + tall * 0.08), 0.009))
            fronts += leaf
            hands += grip(sampler, wide * 0.8, (x, y, top - 0.05), False)
    fronts.append(box((width, 0.06, TOP_M - face - 0.03), (0, y + 0.03, face + 0.002)))
    knobs = control_knobs(
        sampler, spread(sampler.integer(6, 9), width * 0.86), y, (face + TOP_M) / 2 - 0.01
    )
    hands += _towel_rail(width) if sampler.chance(0.6) else []
    plate = [box((width, DEPTH_M, 0.028), (0, 0, TOP_M - 0.028))]
    if sampler.chance(0.5):
        plate.append(
            box((width, 0.03, sampler.uniform(0.06, 0.3)), (0, DEPTH_M / 2 - 0.015, TOP_M))
        )
    burners, grates = gas_burners(sampler, width - 0.06, 3)
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing + fronts),
        (sampler.metal(), plate),
        (sampler.dark(), grates + glass),
        (sampler.metal(), hands + burners),
        (sampler.metal(), knobs),
        (rubber(sampler), dark),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    CATEGORY: (cooker, gas_range, range_cooker, column, open_oven, retro_stove, iron_range),
    "dishwasher": (striped, half_open, integrated, compact),
}
