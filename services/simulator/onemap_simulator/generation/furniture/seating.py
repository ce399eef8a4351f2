"""Sofas, armchairs, chairs, stools and benches."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cone, cylinder, rod, rounded_box
from onemap_simulator.generation.model import Material, Model, assemble, support_surface
from onemap_simulator.generation.sampler import Sampler


def legs(
    sampler: Sampler, width: float, depth: float, height: float, thickness: float = 0.045
) -> list[Mesh]:
    """Four legs under the corners of a rectangle: square, round, tapered or splayed."""
    kind = sampler.integer(0, 3)
    x, y = width / 2 - thickness, depth / 2 - thickness
    corners = [(sx * x, sy * y) for sx in (-1, 1) for sy in (-1, 1)]
    if kind == 0:
        return [box((thickness, thickness, height), (*at, 0.0)) for at in corners]
    if kind == 1:
        return [cylinder(thickness / 2, height, (*at, 0.0), 8) for at in corners]
    if kind == 2:
        return [cone((thickness * 0.3, thickness * 0.6), height, (*at, 0.0), 8) for at in corners]
    return [
        rod((at[0], at[1], 0.0), (at[0] * 0.82, at[1] * 0.82, height), thickness * 0.4)
        for at in corners
    ]


def sofa(sampler: Sampler) -> Model:
    """Two to four seats side by side between arms, a long back, cushions."""
    return _upholstered(sampler, "sofa", sampler.choice([2, 2, 3, 3, 4]))


def armchair(sampler: Sampler) -> Model:
    """One upholstered seat between arms."""
    return _upholstered(sampler, "armchair", 1)


def _upholstered(sampler: Sampler, category: str, seats: int) -> Model:
    seat_w = sampler.size(0.55, 0.68) if seats > 1 else sampler.size(0.52, 0.62)
    depth, arm = sampler.size(0.8, 0.95), sampler.size(0.12, 0.24)
    leg = sampler.size(0.05, 0.15)
    base_h, seat_h, back_h = (
        sampler.size(0.16, 0.24),
        sampler.size(0.13, 0.18),
        sampler.size(0.75, 0.95),
    )
    arm_h = sampler.size(0.52, 0.66)
    inner = seats * seat_w
    width, back_d, soft = inner + 2 * arm, sampler.size(0.18, 0.26), sampler.size(0.03, 0.07)
    front_y, back_y = -depth / 2, depth / 2
    cover, cushions = sampler.upholstery(), []
    body = [
        rounded_box((width, depth - 0.02, base_h), (0, 0, leg), soft),
        rounded_box((width, back_d, back_h - leg), (0, back_y - back_d / 2, leg), soft),
    ]
    body += [
        rounded_box((arm, depth, arm_h - leg), (side * (width - arm) / 2, 0, leg), soft)
        for side in (-1, 1)
    ]
    if sampler.chance(0.3):  # rolled arms
        for side in (-1, 1):
            roll = cylinder(arm * 0.62, depth * 0.96, segments=12).rotated("x", 90)
            body.append(roll.translated(side * (width - arm) / 2, depth * 0.48, arm_h))
    top, seat_d = leg + base_h, depth - back_d
    for seat in range(seats):
        x = (seat - (seats - 1) / 2) * seat_w
        size = (seat_w - 0.015, seat_d, seat_h)
        cushions.append(rounded_box(size, (x, front_y + seat_d / 2 - 0.01, top), 0.06))
        rest = rounded_box((seat_w - 0.02, 0.16, back_h - top - seat_h + 0.03), (0, 0, 0), 0.07)
        lean = rest.rotated("x", -10).translated(x, back_y - back_d - 0.06, top + seat_h - 0.02)
        cushions.append(lean)
    second = cover if sampler.chance(0.65) else sampler.upholstery()
    return assemble(
        category,
        (cover, body),
        (second, cushions),
        (sampler.wood(), legs(sampler, width - 0.06, depth - 0.06, leg + 0.01, 0.06)),
        support_surfaces=(
            support_surface(inner - 0.2, 0.2, top + seat_h)._replace(y_min=-0.2, y_max=0.05),
        ),
    )


def chair(sampler: Sampler) -> Model:
    """A wooden or plastic chair, or an office chair on castors."""
    return _office_chair(sampler) if sampler.chance(0.3) else _legged_chair(sampler)


def _legged_chair(sampler: Sampler) -> Model:
    width, depth = sampler.size(0.42, 0.5), sampler.size(0.42, 0.5)
    seat_h, back_h = sampler.size(0.43, 0.48), sampler.size(0.82, 1.05)
    frame = sampler.wood() if sampler.chance(0.75) else sampler.metal()
    seat_material = frame if sampler.chance(0.4) else sampler.upholstery()
    post = sampler.size(0.03, 0.045)
    y, x = depth / 2 - post / 2, width / 2 - post / 2
    meshes = legs(sampler, width, depth, seat_h, post + 0.01)
    meshes += [
        box((post, post, back_h - seat_h + 0.02), (side * x, y, seat_h - 0.02)) for side in (-1, 1)
    ]
    seat = [rounded_box((width, depth, sampler.size(0.03, 0.07)), (0, 0, seat_h - 0.02), 0.02)]
    kind = sampler.integer(0, 2)
    span_w = width - 2 * post
    if kind == 0:  # slats across
        for height in np.linspace(seat_h + 0.15, back_h - 0.08, sampler.integer(2, 4)):
            meshes.append(box((span_w + post, 0.02, 0.06), (0, y, float(height))))
    elif kind == 1:  # spindles
        meshes.append(box((width, 0.03, 0.07), (0, y, back_h - 0.07)))
        for at in np.linspace(-span_w / 2 + 0.03, span_w / 2 - 0.03, sampler.integer(3, 5)):
            meshes.append(cylinder(0.011, back_h - seat_h - 0.05, (float(at), y, seat_h), 6))
    else:  # a padded or solid back
        size = (span_w + post, 0.04, (back_h - seat_h) * sampler.uniform(0.5, 0.8))
        seat.append(rounded_box(size, (0, y - 0.01, back_h - size[2]), 0.02))
    return assemble("chair", (frame, meshes), (seat_material, seat))


def _office_chair(sampler: Sampler) -> Model:
    radius, seat_h = sampler.size(0.27, 0.32), sampler.size(0.45, 0.52)
    width, depth, back_h = (
        sampler.size(0.46, 0.54),
        sampler.size(0.44, 0.5),
        sampler.size(0.45, 0.65),
    )
    metal, cover, wheel = sampler.metal(), sampler.upholstery(), sampler.dark()
    star, castors = [], []
    for angle in np.radians(np.arange(5) * 72 + 90):
        x, y = radius * float(np.cos(angle)), radius * float(np.sin(angle))
        star.append(rod((0, 0, 0.1), (x, y, 0.08), 0.022))
        castors.append(
            cylinder(0.032, 0.03, segments=8).rotated("x", 90).translated(x, y + 0.015, 0.032)
        )
    column = cylinder(0.03, seat_h - 0.08, (0, 0, 0.08), 10)
    support = box((0.06, 0.025, back_h), (0, depth / 2 + 0.02, seat_h))
    pads = [
        rounded_box((width, depth, 0.09), (0, 0, seat_h), 0.045),
        rounded_box(
            (width * 0.92, 0.08, back_h * 0.75), (0, depth / 2 - 0.02, seat_h + 0.25), 0.04
        ),
    ]
    if sampler.chance(0.6):
        for side in (-1, 1):
            x = side * (width / 2 + 0.03)
            star.append(rod((x, 0.05, seat_h), (x, 0.05, seat_h + 0.2), 0.016))
            castors.append(box((0.06, 0.26, 0.03), (x, 0.0, seat_h + 0.2)))
    return assemble("chair", (metal, [*star, column, support]), (cover, pads), (wheel, castors))


def stool(sampler: Sampler) -> Model:
    """A seat without back: a bar stool on a column or a low stool on legs."""
    seat_material, frame = (
        sampler.upholstery(),
        sampler.metal() if sampler.chance(0.5) else sampler.wood(),
    )
    radius, height = (
        sampler.size(0.17, 0.21),
        sampler.choice([sampler.size(0.42, 0.5), sampler.size(0.62, 0.78)]),
    )
    round_seat = sampler.chance(0.7)
    if round_seat:
        seat = cylinder(radius, 0.06, (0, 0, height - 0.06), 18)
    else:
        seat = rounded_box((radius * 2, radius * 2, 0.06), (0, 0, height - 0.06), 0.02)
    if height > 0.55 and sampler.chance(0.5):
        frame_meshes = [
            cylinder(0.03, height - 0.06, segments=10),
            cylinder(radius * 0.95, 0.03, segments=18),
            *_foot_ring(radius * 0.8, height * 0.35, spokes=True),
        ]
    else:
        frame_meshes = legs(sampler, radius * 2, radius * 2, height - 0.05, 0.04)
        frame_meshes += _foot_ring(radius * 0.95, height * 0.35, spokes=False)
    return assemble("stool", (seat_material, [seat]), (frame, frame_meshes))


def _foot_ring(radius: float, height: float, *, spokes: bool) -> list[Mesh]:
    corners = [(radius * x, radius * y, height) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    bars = [rod(corners[i], corners[(i + 1) % 4], 0.011, 6) for i in range(4)]
    if spokes:
        bars += [rod((0, 0, height), corner, 0.011, 6) for corner in corners]
    return bars


def bench(sampler: Sampler) -> Model:
    """A long seat without arms, of slats or padded, with or without a low shelf."""
    width, depth, height = (
        sampler.size(1.0, 1.4),
        sampler.size(0.34, 0.42),
        sampler.size(0.42, 0.48),
    )
    wood = sampler.wood()
    meshes: list[Mesh] = []
    pads: list[Mesh] = []
    cover: Material = sampler.upholstery()
    if sampler.chance(0.5):
        count = sampler.integer(3, 4)
        slat = depth / count
        for index in range(count):
            y = (index - (count - 1) / 2) * slat
            meshes.append(box((width, slat * 0.82, 0.035), (0, y, height - 0.035)))
    else:
        meshes.append(box((width, depth, 0.04), (0, 0, height - 0.1)))
        pads.append(rounded_box((width, depth, 0.07), (0, 0, height - 0.06), 0.03))
    if sampler.chance(0.5):
        meshes += [
            box((0.05, depth, height - 0.06), (side * (width / 2 - 0.1), 0, 0)) for side in (-1, 1)
        ]
        meshes.append(box((width - 0.2, 0.03, 0.08), (0, 0, height * 0.3)))
    else:
        meshes += legs(sampler, width - 0.1, depth, height - 0.05, 0.06)
    support_surfaces = (support_surface(width, depth, height),)
    return assemble("bench", (wood, meshes), (cover, pads), support_surfaces=support_surfaces)
