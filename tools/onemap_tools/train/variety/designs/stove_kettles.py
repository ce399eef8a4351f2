"""Kettles for the stove: whistling and enamelled ones."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, ellipsoid, lathe, torus, tube
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import centred
from onemap_tools.train.variety.designs.kettles import CATEGORY, Profile


def _arch(radius: float, z: float, rise: float, thick: float, turn: float) -> list[Mesh]:
    angle = np.linspace(0.0, np.pi, 11)
    points = [(radius * np.cos(a), 0.0, z + rise * np.sin(a) ** 0.7) for a in angle]
    return [tube(points, thick, 8).rotated("z", turn)]


def whistling(sampler: Sampler) -> Model:
    """A stove-top whistling kettle: a dome, a stubby spout with a whistle, a high arched grip."""
    radius, tall = sampler.size(0.09, 0.115), sampler.size(0.11, 0.15)
    curve = sampler.uniform(0.6, 0.9)
    profile: Profile = [(radius * 0.92, 0), (radius, 0.015)]
    for share in (0.3, 0.55, 0.8, 0.95, 1.0):
        profile.append(
            (max(radius * (1 - share**2) ** (curve / 2), 0.028), 0.015 + share * (tall - 0.015))
        )
    body = [lathe(profile, segments=20)]
    at = radius * 0.8
    spout = [lathe([(0.026, 0), (0.018, 0.06), (0.021, 0.065)], segments=10).rotated("y", 52)]
    spout = [spout[0].translated(at * 0.85, 0, tall * 0.5)]
    cap = ellipsoid((0.022, 0.022, 0.018), (at * 0.85 + 0.056, 0, tall * 0.5 + 0.045), 10)
    knob = [
        lathe(
            [(0.03, 0), (0.03, 0.006), (0.008, 0.01), (0.016, 0.028), (0.001, 0.034)],
            (0, 0, tall - 0.002),
            10,
        )
    ]
    frame = _arch(radius * 0.72, tall * 0.6, sampler.uniform(0.12, 0.16), 0.006, 0)
    thick = sampler.uniform(0.012, 0.017)
    rise = float(frame[0].vertices[:, 2].max()) - 0.006
    angle = np.linspace(-1, 1, 5)
    grips = [tube([(a * radius * 0.42, 0, rise - 0.008 * a * a) for a in angle], thick, 8)]
    base = [cylinder(radius * 0.96, 0.012, (0, 0, 0.0), 20)]
    return centred(
        assemble(
            CATEGORY,
            (sampler.enamel(), body + spout),
            (sampler.metal(), frame + base),
            (sampler.plastic(), [*grips, *knob, cap]),
        )
    )


def enamel_kettle(sampler: Sampler) -> Model:
    """An old enamelled stove kettle: a round belly, a curved spout, a bail with a roll."""
    radius, tall = sampler.size(0.085, 0.115), sampler.size(0.12, 0.18)
    profile: Profile = [(radius * 0.75, 0), (radius * 0.98, tall * 0.2), (radius, tall * 0.45)]
    profile += [(radius * 0.85, tall * 0.75), (radius * 0.5, tall), (radius * 0.52, tall + 0.008)]
    skin = [lathe(profile, segments=18)]
    x = radius * 0.85
    path = [
        (x, 0, tall * 0.3),
        (x + 0.04, 0, tall * 0.42),
        (x + 0.055, 0, tall * 0.75),
        (x + 0.085, 0, tall * 0.98),
    ]
    skin.append(tube(path, sampler.uniform(0.014, 0.02), 8))
    lid = [
        lathe([(radius * 0.54, 0), (radius * 0.4, 0.018), (0.001, 0.026)], (0, 0, tall + 0.006), 16)
    ]
    lid.append(lathe([(0.008, 0), (0.018, 0.016), (0.001, 0.026)], (0, 0, tall + 0.03), 10))
    rise = sampler.uniform(0.1, 0.14)
    bail = _arch(radius * 0.86, tall * 0.72, rise, 0.0055, 0)
    top = float(bail[0].vertices[:, 2].max()) - 0.0055
    roll = [lathe([(0.009, 0), (0.014, 0.03), (0.014, 0.06), (0.009, 0.09)], segments=10)]
    roll = [roll[0].rotated("y", 90).translated(-0.045, 0, top)]
    rim = [torus(radius * 0.51, 0.006, (0, 0, tall + 0.004), 18)]
    ears = [box((0.014, 0.03, 0.035), (side * radius * 0.86, 0, tall * 0.66)) for side in (-1, 1)]
    return centred(
        assemble(
            CATEGORY,
            (sampler.enamel(), skin),
            (sampler.enamel(), lid),
            (sampler.metal(), bail + ears + rim),
            (sampler.wood(), roll),
        )
    )
