"""Kettles: electric jugs, goosenecks, of glass, of the 1950s."""

from __future__ import annotations

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    ellipsoid,
    from_faces,
    lathe,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import centred, rubber

CATEGORY = "kettle"
Profile = list[tuple[float, float]]


def _lip(radius: float, z: float, out: float, tall: float) -> Mesh:
    """A short pouring lip at +x: a wedge on the side of a body of ``radius``, its top at z."""
    inner, half = radius * 0.72, radius * 0.5
    points = [
        (inner, -half, z),
        (inner, half, z),
        (radius + out, 0.012, z),
        (radius + out, -0.012, z),
    ]
    points += [(inner, -half * 0.6, z - tall), (inner, half * 0.6, z - tall)]
    faces = [(0, 3, 2), (0, 2, 1), (4, 5, 2), (4, 2, 3), (0, 4, 3), (1, 2, 5), (0, 1, 5), (0, 5, 4)]
    return from_faces(points, faces)


def _side_grip(sampler: Sampler, x: float, low: float, high: float) -> list[Mesh]:
    """A handle at -x from ``high`` down to ``low``: closed, or open below."""
    out = sampler.uniform(0.045, 0.075)
    path = [(-x * 0.8, 0, high), (-x - out * 0.7, 0, high + 0.004), (-x - out, 0, high - 0.025)]
    path.append((-x - out * sampler.uniform(0.8, 1.0), 0, low + 0.035))
    if sampler.chance(0.65):
        path += [(-x - out * 0.5, 0, low), (-x * 0.92, 0, low)]
    return [tube(path, sampler.uniform(0.011, 0.016), 8).scaled(1, sampler.uniform(0.8, 1.3), 1)]


def _stand(sampler: Sampler, radius: float) -> list[Mesh]:
    """The electric base with its lead trailing to the back."""
    z = 0.018
    base = [lathe([(radius * 1.08, 0), (radius * 1.12, z * 0.6), (radius * 0.95, z)], segments=18)]
    if sampler.chance(0.6):
        reach = radius + sampler.uniform(0.03, 0.06)
        lead = [(0, radius, 0.008), (0.01, reach, 0.006), (0.05, reach + 0.02, 0.006)]
        base.append(tube(lead, 0.0045, 5))
    return base


def jug(sampler: Sampler) -> Model:
    """An electric jug kettle on its base: tall body, lip, lid, side handle, water window."""
    radius, tall = sampler.size(0.065, 0.085), sampler.size(0.17, 0.23)
    top = radius * sampler.uniform(0.7, 1.0)
    belly = sampler.uniform(0.95, 1.12)
    profile: Profile = [
        (radius, 0.0),
        (radius * belly, tall * 0.25),
        (top, tall * 0.95),
        (top * 0.92, tall),
    ]
    body = [
        lathe(profile, (0, 0, 0.02), 18),
        _lip(top, tall + 0.012, sampler.uniform(0.02, 0.045), tall * 0.25),
    ]
    lid = [lathe([(top * 0.9, 0), (top * 0.8, 0.014), (0.001, 0.02)], (0, 0, tall + 0.018), 16)]
    lid.append(rounded_box((0.035, 0.02, 0.016), (0, 0, tall + 0.034), 0.006))
    hand = _side_grip(sampler, top, tall * 0.3, tall * 0.95)
    bands = [cylinder(radius * 1.02, tall * 0.1, (0, 0, 0.0195), 18)]
    gauge = [rounded_box((0.02, 0.006, tall * 0.5), (0, -radius * 1.01, tall * 0.25), 0.003)]
    if sampler.chance(0.4):
        hand.append(box((0.022, 0.024, 0.01), (-radius - 0.05, 0, tall * 0.98)))
    return centred(
        assemble(
            CATEGORY,
            (sampler.enamel(), body),
            (sampler.plastic(), lid + hand),
            (sampler.metal(), bands),
            (sampler.pale(), gauge),
            (rubber(sampler), _stand(sampler, radius)),
        )
    )


def gooseneck(sampler: Sampler) -> Model:
    """A pour-over kettle: a squat cone, a thin swan's neck from low down, an angular grip."""
    radius, tall = sampler.size(0.07, 0.09), sampler.size(0.11, 0.16)
    top = radius * sampler.uniform(0.6, 0.95)
    body = [
        lathe(
            [(radius, 0), (radius * 1.02, 0.02), (top, tall), (top * 0.9, tall + 0.008)],
            (0, 0, 0.02),
            20,
        )
    ]
    out, rise = radius + sampler.uniform(0.06, 0.09), tall + sampler.uniform(0.02, 0.06)
    neck = [
        (radius * 0.85, 0, 0.05),
        (radius + 0.03, 0, 0.055),
        (radius + 0.045, 0, 0.09),
        (out - 0.025, 0, rise * 0.75),
        (out, 0, rise),
        (out + 0.03, 0, rise + 0.004),
    ]
    body.append(tube(neck, 0.009, 8))
    lid = [lathe([(top * 0.88, 0), (top * 0.8, 0.012), (0.01, 0.015)], (0, 0, tall + 0.027), 16)]
    lid.append(lathe([(0.006, 0), (0.014, 0.014), (0.01, 0.024)], (0, 0, tall + 0.04), 10))
    x, away = top * 0.95, sampler.uniform(0.07, 0.1)
    path = [
        (-x * 0.9, 0, tall * 0.95),
        (-x - away * 0.6, 0, tall + 0.01),
        (-x - away, 0, tall * 0.95),
    ]
    path += [(-x - away * 0.95, 0, tall * 0.35)]
    grips = [tube(path, 0.011, 8)]
    if sampler.chance(0.5):
        foot = _stand(sampler, radius)
    else:
        foot = [cylinder(radius * 0.97, 0.0205, segments=20)]
    return centred(
        assemble(
            CATEGORY,
            (sampler.metal(), body),
            (sampler.wood(), grips),
            (sampler.metal(), lid),
            (rubber(sampler), foot),
        )
    )


def glass_kettle(sampler: Sampler) -> Model:
    """A glass cylinder or globe between a metal foot and collar, with water and a heavy handle."""
    radius, tall = sampler.size(0.07, 0.085), sampler.size(0.15, 0.2)
    globe = sampler.chance(0.4)
    waist = sampler.uniform(1.1, 1.3) if globe else 1.0
    foot = [cylinder(radius, 0.035, (0, 0, 0.02), 18)]
    glass = [
        lathe(
            [
                (radius * 0.98, 0),
                (radius * waist, tall * 0.35),
                (radius * 0.96 * waist, tall * 0.55),
                (radius * 0.85, tall - 0.03),
            ],
            (0, 0, 0.054),
            20,
        )
    ]
    collar = [cylinder(radius * 0.9, 0.03, (0, 0, tall + 0.018), 18)]
    collar.append(_lip(radius * 0.9, tall + 0.046, 0.03, 0.03))
    lid = [
        lathe([(radius * 0.86, 0), (radius * 0.7, 0.014), (0.001, 0.018)], (0, 0, tall + 0.047), 16)
    ]
    lid.append(cylinder(0.014, 0.014, (0, 0, tall + 0.062), 10))
    x = radius * 0.95
    grips = [rounded_box((0.05, 0.03, 0.024), (-x - 0.015, 0, tall + 0.018), 0.008)]
    grips.append(rounded_box((0.022, 0.032, tall * 0.8), (-x - 0.045, 0, tall * 0.25), 0.008))
    if sampler.chance(0.6):
        grips.append(rounded_box((0.05, 0.028, 0.02), (-x - 0.018, 0, tall * 0.24), 0.007))
    return centred(
        assemble(
            CATEGORY,
            (sampler.pale(), glass),
            (sampler.metal(), foot + collar),
            (sampler.plastic(), lid + grips),
            (rubber(sampler), _stand(sampler, radius)),
        )
    )


def retro_kettle(sampler: Sampler) -> Model:
    """A 1950s electric one: a stepped dome, a chrome ring, a thermometer dial, a swept handle."""
    radius, tall = sampler.size(0.085, 0.1), sampler.size(0.18, 0.23)
    steps: Profile = [(radius, 0), (radius, tall * 0.2), (radius * 0.96, tall * 0.22)]
    steps += [
        (radius * 0.88, tall * 0.55),
        (radius * 0.68, tall * 0.85),
        (radius * 0.6, tall * 0.9),
    ]
    body = [lathe([*steps, (radius * 0.5, tall * 0.92)], (0, 0, 0.02), 20)]
    body.append(_lip(radius * 0.72, tall * 0.86, 0.035, tall * 0.25))
    chrome = [torus(radius * 0.995, 0.006, (0, 0, 0.02 + tall * 0.21), 20)]
    lid = [
        lathe(
            [(radius * 0.58, 0), (radius * 0.45, 0.02), (0.001, 0.032)],
            (0, 0, 0.015 + tall * 0.92),
            16,
        )
    ]
    chrome.append(ellipsoid((0.014, 0.014, 0.014), (0, 0, tall * 0.92 + 0.055), 10))
    gauge = [
        cylinder(0.026, 0.014, segments=14)
        .rotated("x", 98)
        .translated(0, -radius * 0.84, tall * 0.55)
    ]
    grips = _side_grip(sampler, radius * 0.72, tall * 0.35, tall * 0.9)
    return centred(
        assemble(
            CATEGORY,
            (sampler.enamel(), body),
            (sampler.enamel(), lid),
            (sampler.metal(), chrome),
            (sampler.pale(), gauge),
            (sampler.plastic(), grips),
            (rubber(sampler), _stand(sampler, radius)),
        )
    )
