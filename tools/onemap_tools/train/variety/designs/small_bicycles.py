"""Bicycles with small wheels: folding ones and children's, with training wheels."""

from __future__ import annotations

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    rod,
    rounded_box,
    tube,
)
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.bicycle_parts import (
    BicyclePlan,
    drive_train,
    frame_plan,
    handlebar,
    mudguards,
    saddle_on_post,
    stays,
    wheels,
)


def folding_bicycle(sampler: Sampler) -> Model:
    """A folding bicycle: small wheels, one thick low beam with a hinge, long posts, rack."""
    r = sampler.size(0.19, 0.24)
    plan = frame_plan(r, sampler.size(0.9, 1.02), r + 0.3, r + 0.3)
    tyres, metal = wheels(plan, 0.02, sampler.integer(8, 12))
    z = r + sampler.uniform(0.1, 0.16)
    arch = sampler.uniform(0.0, 0.07)
    beam = [
        (plan.rear[0] + 0.16, 0, z - 0.02),
        (-0.12, 0, z + arch),
        (0.12, 0, z + arch),
        (plan.low_head[0], 0, plan.low_head[2]),
    ]
    frame = [
        tube(beam, 0.032, 8),
        rod(plan.crank, plan.seat, 0.02),
        rod(plan.low_head, plan.head, 0.026),
    ]
    frame += [rod(plan.crank, (plan.crank[0], 0, z), 0.02), *stays(plan, 0.011)]
    frame += mudguards(plan, 110)
    hinge = [box((0.05, 0.085, 0.09), (0.04, 0, z + arch - 0.045))]
    drive, black = drive_train(plan, 0.15)
    post, saddle = saddle_on_post(plan, sampler.uniform(0.22, 0.34), 0.08)
    bar, grips, middle = handlebar(plan, sampler.uniform(0.32, 0.42), 0.54, 0.04)
    hinge.append(box((0.05, 0.06, 0.05), (plan.head[0] - 0.01, 0, plan.head[2] - 0.01)))
    if sampler.chance(0.5):
        x, top = plan.rear[0], 2 * r + 0.07
        metal += [box((0.3, 0.02, 0.012), (x - 0.02, y, top)) for y in (-0.06, 0.0, 0.06)]
        metal += [rod((x, y * 0.8, r), (x, y, top), 0.007, 6) for y in (-0.06, 0.06)]
    if sampler.chance(0.4):
        bag = rounded_box((0.14, 0.24, 0.2), (middle[0] + 0.12, 0, middle[2] - 0.24), 0.03)
        hinge.append(bag)
    return assemble(
        "bicycle",
        (sampler.plastic(), frame),
        (sampler.metal(), [*metal, *drive, post, *bar]),
        (sampler.dark(), [*tyres, *grips, *black, *saddle]),
        (sampler.fabric(), hinge),
    )


def _training_wheels(plan: BicyclePlan) -> tuple[list[Mesh], list[Mesh]]:
    """Two small wheels beside the rear one, and their struts."""
    x, small, struts = plan.rear[0], [], []
    for side in (-1, 1):
        wheel = cylinder(0.065, 0.03, segments=16).rotated("x", 90)
        small.append(wheel.translated(x, side * 0.19 + 0.015, 0.065))
        knee = (x, side * 0.16, 0.12)
        struts.append(rod((x, side * 0.05, plan.radius), knee, 0.009, 6))
        struts.append(rod(knee, (x, side * 0.19, 0.065), 0.009, 6))
    return small, struts


def childs_bicycle(sampler: Sampler) -> Model:
    """A child's bicycle: small fat wheels, training wheels, high bar with tassels, chain guard."""
    r = sampler.size(0.15, 0.2)
    plan = frame_plan(
        r, sampler.size(0.6, 0.74), r + sampler.uniform(0.18, 0.26), r + sampler.uniform(0.28, 0.34)
    )
    tyres, metal = wheels(plan, 0.026, sampler.choice([5, 8, 10]))
    low = (plan.low_head[0], 0.0, plan.low_head[2] - 0.02)
    frame = [rod(plan.crank, plan.seat, 0.02), rod(plan.crank, low, 0.024)]
    frame += [rod(plan.low_head, plan.head, 0.024), *stays(plan, 0.01)]
    if sampler.chance(0.5):
        frame.append(rod((plan.seat[0] + 0.02, 0, plan.seat[2] - 0.05), low, 0.018))
    frame += mudguards(plan, 100)
    drive, black = drive_train(plan, 0.1)
    post, saddle = saddle_on_post(plan, 0.07, 0.075)
    bar, grips, middle = handlebar(plan, 0.15, 0.42, 0.05)
    small: list[Mesh] = []
    if sampler.chance(0.8):
        small, struts = _training_wheels(plan)
        metal += struts
    guard = [
        rounded_box(
            (plan.crank[0] - plan.rear[0] + 0.06, 0.02, 0.08),
            ((plan.crank[0] + plan.rear[0]) / 2, -0.065, r - 0.04),
            0.009,
        )
    ]
    if sampler.chance(0.5):
        guard.append(rounded_box((0.02, 0.2, 0.16), (middle[0] + 0.05, 0, middle[2] - 0.13), 0.009))
    if sampler.chance(0.5):
        guard += [
            rod(
                (middle[0] - 0.06, s * 0.22, middle[2]),
                (middle[0] - 0.1, s * 0.26, middle[2] - 0.14 - k),
                0.005,
                4,
            )
            for s in (-1, 1)
            for k in (0.0, 0.03)
        ]
    return assemble(
        "bicycle",
        (sampler.plastic(), frame),
        (sampler.plastic(), guard),
        (sampler.dark(), [*tyres, *grips, *black]),
        (sampler.plastic(), [*small, *saddle]),
        (sampler.metal(), [*metal, *drive, post, *bar]),
    )
