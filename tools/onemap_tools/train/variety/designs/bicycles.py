"""Bicycles: city, racing, mountain, folding and children's; along x, the front towards +x."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, rod, rounded_box, torus, tube
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs import small_bicycles
from onemap_tools.train.variety.designs.bicycle_parts import (
    BicyclePlan,
    drive_train,
    frame_plan,
    handlebar,
    mudguards,
    saddle_on_post,
    stays,
    wheels,
    wire_basket,
)


def _rack(plan: BicyclePlan) -> list[Mesh]:
    """A luggage rack over the rear wheel."""
    x, z = plan.rear[0], 2 * plan.radius + 0.05
    bars = [box((0.36, 0.02, 0.012), (x + 0.02, y, z)) for y in (-0.06, 0.0, 0.06)]
    bars += [rod((x, y * 0.8, plan.radius), (x - 0.08, y, z), 0.006, 6) for y in (-0.06, 0.06)]
    bars.append(rod((x + 0.2, 0, z), (plan.seat[0], 0, plan.seat[2] - 0.06), 0.007, 6))
    return bars


def _chain_case(plan: BicyclePlan) -> Mesh:
    """A case round the chain, from the crank to the rear hub."""
    cx, r = plan.crank[0], plan.radius
    return rounded_box(
        (cx - plan.rear[0] + 0.12, 0.03, 0.13), ((cx + plan.rear[0]) / 2, -0.06, r - 0.075), 0.012
    )


def city_bicycle(sampler: Sampler) -> Model:
    """A step-through city bicycle: swept bar, mudguards, rack, chain case, basket and lamp."""
    r = sampler.size(0.29, 0.34)
    plan = frame_plan(
        r, sampler.size(0.98, 1.1), r + sampler.uniform(0.26, 0.36), r + sampler.uniform(0.4, 0.48)
    )
    tyres, metal = wheels(plan, 0.022, sampler.integer(10, 14))
    (cx, _, cz), (hx, _, hz) = plan.crank, plan.low_head
    dip = [(hx, 0, hz), (hx - 0.13, 0, hz - 0.25), (cx + 0.1, 0, cz + 0.06), plan.crank]
    frame = [
        tube(dip, 0.021, 8),
        rod(plan.crank, plan.seat, 0.018),
        rod(plan.low_head, plan.head, 0.022),
    ]
    if sampler.chance(0.6):
        frame.append(
            tube(
                [(p[0] - 0.02, 0, p[2] + 0.1) for p in dip[:3]]
                + [(plan.seat[0] + 0.03, 0, cz + 0.14)],
                0.015,
                6,
            )
        )
    frame += stays(plan, 0.01)
    frame += mudguards(plan, sampler.uniform(110, 150))
    drive, black = drive_train(plan, 0.16)
    post, saddle = saddle_on_post(plan, 0.14, 0.095)
    bar, grips, middle = handlebar(plan, 0.14, 0.56, 0.2)
    if sampler.chance(0.6):
        metal += _rack(plan)
    groups = [(sampler.plastic(), frame), (sampler.dark(), [*tyres, *grips, *black])]
    groups.append((sampler.metal(), [*metal, *drive, post, *bar]))
    groups.append((sampler.upholstery(), saddle))
    if sampler.chance(0.5):
        groups.append((sampler.plastic(), [_chain_case(plan)]))
    if sampler.chance(0.65):
        basket = wire_basket((plan.front[0] + 0.02, 0, middle[2] - 0.26), 0.36, 0.28, 0.24)
        basket.append(
            rod(
                (plan.head[0], 0, middle[2] - 0.2), (plan.front[0] - 0.08, 0, middle[2] - 0.2), 0.01
            )
        )
        groups.append((sampler.metal() if sampler.chance(0.5) else sampler.wood(), basket))
    else:
        lamp = cylinder(0.045, 0.07, segments=10).rotated("y", 90)
        groups.append(
            (sampler.pale(), [lamp.translated(plan.head[0] + 0.02, 0, plan.head[2] - 0.02)])
        )
    return assemble("bicycle", *groups)


def racing_bicycle(sampler: Sampler) -> Model:
    """A racing bicycle: level or sloping top tube, thin tyres, dropped bars, a bottle."""
    r = sampler.size(0.32, 0.345)
    level = sampler.uniform(0.44, 0.5)
    plan = frame_plan(
        r, sampler.size(0.95, 1.02), r + level - sampler.uniform(0.0, 0.09), r + level
    )
    tyres, metal = wheels(plan, 0.013, sampler.choice([5, 12, 16]))
    pairs = [
        (plan.crank, plan.seat),
        (plan.seat, plan.head),
        (plan.crank, plan.low_head),
        (plan.low_head, plan.head),
    ]
    thick = sampler.uniform(0.014, 0.024)
    frame = [rod(a, b, thick) for a, b in pairs] + stays(plan, 0.008)
    drive, black = drive_train(plan, 0.17)
    post, saddle = saddle_on_post(plan, sampler.uniform(0.12, 0.2), 0.065)
    x, _, z = plan.head
    bar = [rod(plan.head, (x + 0.06, 0, z + 0.04), 0.014)]
    tape = []
    for side in (-1, 1):
        y = side * 0.21
        hook = [
            (x + 0.06, side * 0.1, z + 0.04),
            (x + 0.07, y, z + 0.04),
            (x + 0.15, y, z + 0.03),
            (x + 0.18, y, z - 0.03),
            (x + 0.15, y, z - 0.09),
            (x + 0.07, y * 1.03, z - 0.11),
        ]
        tape.append(tube(hook, 0.014))
        tape.append(rod((x + 0.16, y, z + 0.03), (x + 0.2, y, z + 0.075), 0.014))
        tape.append(rod((x + 0.19, y, z + 0.06), (x + 0.2, y, z - 0.06), 0.005, 4))
    bar.append(rod((x + 0.06, -0.12, z + 0.04), (x + 0.06, 0.12, z + 0.04), 0.013))
    groups = [
        (sampler.plastic(), frame),
        (sampler.dark(), [*tyres, *black, *saddle]),
        (sampler.metal(), [*metal, *drive, post, *bar]),
        (sampler.upholstery(), tape),
    ]
    if sampler.chance(0.6):
        (ax, _, az), (bx, _, bz) = plan.crank, plan.low_head
        turn = float(np.degrees(np.arctan2(bx - ax, bz - az)))
        flask = cylinder(0.035, 0.18, (0, 0, 0), 10).rotated("y", turn)
        flask = flask.translated(ax + 0.35 * (bx - ax) - 0.04, 0, az + 0.35 * (bz - az) + 0.035)
        groups.append((sampler.plastic(), [flask]))
    return assemble("bicycle", *groups)


def mountain_bicycle(sampler: Sampler) -> Model:
    """A mountain bicycle: fat knobbly tyres, thick sloping frame, suspension fork, flat bar."""
    r, tyre = sampler.size(0.31, 0.36), sampler.uniform(0.03, 0.05)
    plan = frame_plan(
        r,
        sampler.size(1.02, 1.14),
        r + sampler.uniform(0.24, 0.32),
        r + sampler.uniform(0.42, 0.48),
    )
    tyres, metal = wheels(plan, tyre, sampler.integer(8, 12))
    for hub in (plan.rear, plan.front):
        for a in np.linspace(0, 360, 18, endpoint=False):
            knob = box((0.03, tyre * 1.7, 0.02), (0, 0, r - 0.021)).rotated("y", float(a))
            tyres.append(knob.translated(*hub))
    pairs = [(plan.crank, plan.seat), (plan.crank, plan.low_head), (plan.low_head, plan.head)]
    frame = [rod(a, b, 0.03) for a, b in pairs]
    low = (plan.seat[0] + 0.03, 0.0, plan.seat[2] - 0.07)
    frame += [rod(low, plan.low_head, 0.024), *stays(plan, 0.014)]
    fork = []
    for y in (-0.06, 0.06):
        (ax, _, az), (bx, _, bz) = plan.low_head, plan.front
        fork.append(rod((bx + 0.45 * (ax - bx), y, bz + 0.45 * (az - bz)), (bx, y, bz), 0.024))
    fork.append(box((0.05, 0.16, 0.04), (plan.low_head[0], 0, plan.low_head[2] - 0.03)))
    drive, black = drive_train(plan, 0.17)
    post, saddle = saddle_on_post(plan, sampler.uniform(0.14, 0.24), 0.07)
    bar, grips, _ = handlebar(plan, 0.06, sampler.uniform(0.6, 0.74), 0.05)
    if sampler.chance(0.4):
        spring = [torus(0.028, 0.009, (0, 0, k * 0.022), 10) for k in range(7)]
        at = (plan.seat[0] + 0.07, 0.0, plan.crank[2] + 0.12)
        fork += [m.rotated("y", 35).translated(*at) for m in spring]
    return assemble(
        "bicycle",
        (sampler.plastic(), frame),
        (sampler.plastic(), fork),
        (sampler.dark(), [*tyres, *grips, *black, *saddle]),
        (sampler.metal(), [*metal, *drive, post, *bar]),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "bicycle": (
        city_bicycle,
        racing_bicycle,
        mountain_bicycle,
        small_bicycles.folding_bicycle,
        small_bicycles.childs_bicycle,
    ),
}
