"""Flat televisions on feet, walls, easels and trolleys."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    ellipsoid,
    front_panel,
    prism,
    rod,
    rounded_box,
    tube,
)
from onemap_simulator.generation.model import Material, Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.drawn_images import shown, switched_off
from onemap_tools.train.variety.designs.flat_forms import (
    ellipse_outline,
    rounded_outline,
    settled,
    upright,
    window,
)

Size = tuple[float, float, float]


def picture_of(sampler: Sampler) -> Material:
    """A screen, switched off or showing something."""
    return Material(shown(sampler.rng) if sampler.chance(0.4) else switched_off(sampler.rng))


def casing_of(sampler: Sampler) -> Material:
    """The material of a set's body."""
    if sampler.chance(0.55):
        return sampler.dark()
    return sampler.metal() if sampler.chance(0.6) else sampler.plastic()


def _flat(sampler: Sampler, low: float = 0.7, high: float = 1.45) -> Size:
    """Width, thickness and height of a flat screen."""
    width = sampler.size(low, high)
    return width, sampler.uniform(0.015, 0.05), width * sampler.choice((0.565, 0.58, 0.6, 0.43))


def _set(sampler: Sampler, size: Size, z: float) -> tuple[list[Mesh], Mesh]:
    """A flat body whose front is at y = -thickness / 2 with a thin bezel, and its screen."""
    width, thick, height = size
    bezel, chin = sampler.uniform(0.004, 0.025), sampler.choice((0.008, 0.02, 0.04))
    plate = box((width, thick, height), (0, 0, z))
    if sampler.chance(0.3):
        outline = rounded_outline(width, height, sampler.uniform(0.01, 0.03))
        plate = upright(outline, thick, (0, thick / 2, z + height / 2))
    body = [plate]
    if sampler.chance(0.6):  # the electronics behind the lower half
        deep = sampler.uniform(0.02, 0.05)
        hump = (width * sampler.uniform(0.5, 0.85), deep, height * sampler.uniform(0.35, 0.6))
        body.append(rounded_box(hump, (0, thick / 2 + deep / 2 - 0.003, z + 0.03), 0.012))
    if sampler.chance(0.4):
        body.append(box((0.05, 0.01, 0.012), (0, -thick / 2, z + 0.002)))
    glass = front_panel(width - 2 * bezel, height - bezel - chin, (0, -thick / 2 - 0.003, z + chin))
    return body, glass


def centre_foot(sampler: Sampler) -> Model:
    """A thin flat screen on a neck over one plate: oval, round, square or a bent sheet."""
    width, thick, height = _flat(sampler)
    lift = sampler.uniform(0.04, 0.14)
    body, glass = _set(sampler, (width, thick, height), lift)
    wide, deep, plate = width * sampler.uniform(0.25, 0.6), sampler.uniform(0.18, 0.3), 0.012
    kind = sampler.integer(0, 3)
    if kind == 0:
        foot = [prism(ellipse_outline(wide, deep), plate)]
    elif kind == 1:
        foot = [box((wide, deep, plate))]
    elif kind == 2:
        foot = [prism(rounded_outline(wide, deep, 0.06), 0.03)]
    else:
        outer = [(-wide / 2, -deep / 2), (wide / 2, -deep / 2), (wide * 0.2, deep / 2)]
        foot = [prism([*outer, (-wide * 0.2, deep / 2)], plate)]
    neck_w = sampler.choice((0.05, 0.09, wide * 0.6))
    if sampler.chance(0.5):
        foot.append(box((neck_w, 0.03, lift + 0.05), (0, 0.03, plate - 0.004)))
    else:
        foot += [
            rod((x, 0.03, 0.005), (x, 0.03, lift + 0.06), 0.014) for x in (-neck_w / 2, neck_w / 2)
        ]
    stand = sampler.metal() if sampler.chance(0.6) else sampler.dark()
    return settled(
        "television", (casing_of(sampler), body), (stand, foot), (picture_of(sampler), [glass])
    )


def splayed_feet(sampler: Sampler) -> Model:
    """A thin flat screen on two separate feet near its ends: forks, blades or bent bars."""
    width, thick, height = _flat(sampler)
    lift, deep = sampler.uniform(0.05, 0.1), sampler.uniform(0.1, 0.15)
    body, glass = _set(sampler, (width, thick, height), lift)
    feet: list[Mesh] = []
    kind, share = sampler.integer(0, 2), sampler.uniform(0.25, 0.45)
    for side in (-1, 1):
        x = side * width * share
        if kind == 0:
            lean = side * sampler.uniform(0.0, 0.08)
            feet += [
                rod((x + lean, y, 0.008), (x, 0.0, lift + 0.01), 0.008, 6) for y in (-deep, deep)
            ]
        elif kind == 1:
            outline = [(-deep, 0), (deep, 0), (deep - 0.03, 0.015), (0.015, lift + 0.02)]
            blade = prism([*outline, (-0.015, lift + 0.02), (-deep + 0.03, 0.015)], 0.016)
            feet.append(blade.rotated("x", 90).rotated("z", 90).translated(x - 0.008, 0, 0))
        else:
            feet.append(box((0.04, 2 * deep, 0.012), (x, 0, 0)))
            feet.append(box((0.03, 0.014, lift + 0.01), (x, 0, 0.01)))
    stand = sampler.metal() if sampler.chance(0.6) else sampler.dark()
    return settled(
        "television", (casing_of(sampler), body), (stand, feet), (picture_of(sampler), [glass])
    )


def wall_hung(sampler: Sampler) -> Model:
    """A flat screen on a wall plate or swivel arm, some turned or with a wooden frame."""
    width, thick, height = _flat(sampler, 0.6, 1.5)
    body, glass = _set(sampler, (width, thick, height), 0.0)
    turn = sampler.choice((0.0, 0.0, -14.0, 14.0))
    gap = 0.05 + width / 2 * float(np.sin(np.radians(abs(turn))))
    back = gap + thick
    middle = height * 0.5
    bracket = [box((0.12, 0.02, height * 0.5), (0, back, height * 0.25))]
    if turn:
        elbow = (0.12, back * 0.5, middle)
        bracket += [rod((0, back, middle), elbow, 0.016), rod(elbow, (0, 0.01, middle), 0.016)]
    else:
        bracket += [box((0.3, back, 0.03), (0, back / 2, middle + z)) for z in (-0.06, 0.06)]
    if sampler.chance(0.3):
        cable = [(0.1, 0.03, 0.1), (0.11, 0.05, 0.03), (0.12, back, 0.0)]
        bracket.append(tube(cable, 0.005, 5))
    groups = [(casing_of(sampler), [mesh.rotated("z", turn) for mesh in body])]
    if sampler.chance(0.3):
        edge = window((width + 0.05, height + 0.04), 0.03, 0.03, 0.01 - thick / 2)
        framed = edge.translated(0, 0, -0.02).rotated("z", turn)
        groups.append((sampler.wood(), [framed]))
    groups += [(sampler.dark(), bracket), (picture_of(sampler), [glass.rotated("z", turn)])]
    return settled("television", *groups)


def on_easel(sampler: Sampler) -> Model:
    """A flat screen on three tall wooden or metal legs like a painter's easel."""
    width, thick, height = _flat(sampler, 0.85, 1.3)
    lift, spread = sampler.uniform(0.55, 0.8), width * sampler.uniform(0.25, 0.36)
    body, glass = _set(sampler, (width, thick, height), lift)
    top = lift + height * sampler.choice((0.6, 0.9, 1.15))
    thin, back = sampler.uniform(0.012, 0.022), thick / 2 + 0.06
    feet = ((-spread, back - 0.03), (spread, back - 0.03), (0.0, back + 0.36))
    legs = [rod((x, y, 0.01), (x * 0.15, back, top), thin) for x, y in feet]
    legs.append(box((spread * 1.6, 0.02, 0.05), (0, back - 0.02, lift + height * 0.25)))
    legs.append(box((0.2, back, 0.16), (0, back / 2, lift + height * 0.3)))
    stand = sampler.wood() if sampler.chance(0.7) else sampler.metal()
    return settled(
        "television", (casing_of(sampler), body), (stand, legs), (picture_of(sampler), [glass])
    )


def on_trolley(sampler: Sampler) -> Model:
    """A flat screen on a rolling stand: posts, a shelf and feet with castors."""
    width, thick, height = _flat(sampler, 0.75, 1.3)
    lift = sampler.uniform(0.65, 1.0)
    body, glass = _set(sampler, (width, thick, height), lift)
    back = thick / 2 + 0.075
    posts = (-0.1, 0.1) if sampler.chance(0.6) else (0.0,)
    high = lift + height * sampler.uniform(0.65, 0.95)
    stand = [box((0.05, 0.03, high - 0.1), (x, back, 0.1)) for x in posts]
    stand.append(box((0.32, back, 0.2), (0, back / 2, lift + height * 0.4)))
    foot = width * sampler.uniform(0.28, 0.42)
    stand += [box((0.06, 0.56, 0.035), (side * foot, 0.02, 0.07)) for side in (-1, 1)]
    stand.append(box((2 * foot + 0.06, 0.06, 0.04), (0, back, 0.072)))
    if sampler.chance(0.7):
        stand.append(box((0.42, 0.3, 0.018), (0, back - 0.1, lift * sampler.uniform(0.5, 0.8))))
    wheels = [
        cylinder(0.036, 0.025, segments=10).rotated("y", 90).translated(x * foot - 0.012, y, 0.036)
        for x in (-1, 1)
        for y in (-0.22, 0.26)
    ]
    return settled(
        "television",
        (casing_of(sampler), body),
        (sampler.metal(), stand),
        (sampler.dark(), wheels),
        (picture_of(sampler), [glass]),
    )


def with_soundbar(sampler: Sampler) -> Model:
    """A flat screen on two feet with a long loudspeaker bar in front below it."""
    width, thick, height = _flat(sampler, 0.8, 1.4)
    lift = sampler.uniform(0.08, 0.13)
    body, glass = _set(sampler, (width, thick, height), lift)
    bar_w, bar_h = width * sampler.uniform(0.6, 0.98), lift * sampler.uniform(0.6, 0.9)
    bar = [rounded_box((bar_w, 0.08, bar_h), (0, -0.09, 0), sampler.uniform(0.005, 0.035))]
    trim = [ellipsoid((0.012, 0.006, 0.012), (bar_w * 0.4, -0.13, bar_h / 2), 8)]
    if sampler.chance(0.5):
        bar.append(box((bar_w * 0.9, 0.006, bar_h * 0.5), (0, -0.132, bar_h * 0.25)))
    x = width * sampler.uniform(0.3, 0.45)
    feet = [box((0.03, 0.2, 0.012), (side * x, 0.05, 0)) for side in (-1, 1)]
    feet += [
        box((0.025, 0.016, lift + 0.02), (side * x, thick / 2 + 0.006, 0.006)) for side in (-1, 1)
    ]
    return settled(
        "television",
        (casing_of(sampler), [*body, *feet]),
        (sampler.fabric() if sampler.chance(0.5) else sampler.dark(), bar),
        (sampler.metal(), trim),
        (picture_of(sampler), [glass]),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "television": (
        centre_foot,
        splayed_feet,
        wall_hung,
        on_easel,
        on_trolley,
        with_soundbar,
    )
}
