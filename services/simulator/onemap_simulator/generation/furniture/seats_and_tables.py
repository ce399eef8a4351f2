"""Sofas, chairs, stools, benches, beds, pillows, tables and desks."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Material,
    Mesh,
    Model,
    Top,
    assemble,
    box,
    cone,
    corners,
    cylinder,
    from_faces,
    knob,
    lathe,
    rod,
    rounded_box,
    spread,
    top,
)
from onemap_simulator.generation.style import Sampler


def legs(
    draw: Sampler, width: float, depth: float, height: float, thickness: float = 0.045
) -> list[Mesh]:
    """Four legs under the corners of a rectangle: square, round, tapered or splayed."""
    kind = draw.integer(0, 3)
    places = corners(width / 2 - thickness, depth / 2 - thickness)
    if kind == 0:
        return [box((thickness, thickness, height), (x, y, 0)) for x, y in places]
    if kind == 1:
        return [cylinder(thickness / 2, height, (x, y, 0), 8) for x, y in places]
    if kind == 2:
        radii = (thickness * 0.3, thickness * 0.6)
        return [cone(radii, height, (x, y, 0), 8) for x, y in places]
    return [rod((x, y, 0), (x * 0.82, y * 0.82, height), thickness * 0.4) for x, y in places]


def sofa(draw: Sampler) -> Model:
    """Two to four seats side by side between arms, a long back, cushions."""
    return _upholstered(draw, "sofa", draw.choice([2, 2, 3, 3, 4]))


def armchair(draw: Sampler) -> Model:
    """One upholstered seat between arms."""
    return _upholstered(draw, "armchair", 1)


def _upholstered(draw: Sampler, category: str, seats: int) -> Model:
    seat_w = draw.size(0.55, 0.68) if seats > 1 else draw.size(0.52, 0.62)
    depth, arm, leg = draw.sizes((0.8, 0.95), (0.12, 0.24), (0.05, 0.15))
    base_h, seat_h, back_h = draw.sizes((0.16, 0.24), (0.13, 0.18), (0.75, 0.95))
    arm_h, back_d, soft = draw.sizes((0.52, 0.66), (0.18, 0.26), (0.03, 0.07))
    inner = seats * seat_w
    width, front, back = inner + 2 * arm, -depth / 2, depth / 2
    arms = [s * (width - arm) / 2 for s in (-1, 1)]
    cover = draw.upholstery()
    body = [
        rounded_box((width, depth - 0.02, base_h), (0, 0, leg), soft),
        rounded_box((width, back_d, back_h - leg), (0, back - back_d / 2, leg), soft),
        *(rounded_box((arm, depth, arm_h - leg), (x, 0, leg), soft) for x in arms),
    ]
    if draw.chance(0.3):  # rolled arms
        body += [knob(arm * 0.62, depth * 0.96, (x, depth * 0.48, arm_h), 12) for x in arms]
    seat_z, seat_d, cushions = leg + base_h, depth - back_d, []
    for x in spread(seats, seat_w):
        size = (seat_w - 0.015, seat_d, seat_h)
        cushions.append(rounded_box(size, (x, front + seat_d / 2 - 0.01, seat_z), 0.06))
        rest = rounded_box((seat_w - 0.02, 0.16, back_h - seat_z - seat_h + 0.03), radius=0.07)
        at = (x, back - back_d - 0.06, seat_z + seat_h - 0.02)
        cushions.append(rest.rotated("x", -10).translated(*at))
    second = cover if draw.chance(0.65) else draw.upholstery()
    feet = (draw.wood(), legs(draw, width - 0.06, depth - 0.06, leg + 0.01, 0.06))
    seat = top(inner - 0.2, 0.2, seat_z + seat_h)._replace(y_min=-0.2, y_max=0.05)
    return assemble(category, (cover, body), (second, cushions), feet, tops=[seat])


def chair(draw: Sampler) -> Model:
    """A wooden or plastic chair, or an office chair on castors."""
    return _office_chair(draw) if draw.chance(0.3) else _legged_chair(draw)


def _legged_chair(draw: Sampler) -> Model:
    width, depth = draw.sizes((0.42, 0.5), (0.42, 0.5))
    seat_h, back_h = draw.sizes((0.43, 0.48), (0.82, 1.05))
    frame = draw.wood() if draw.chance(0.75) else draw.metal()
    cover = frame if draw.chance(0.4) else draw.upholstery()
    post = draw.size(0.03, 0.045)
    y, x = depth / 2 - post / 2, width / 2 - post / 2
    meshes = legs(draw, width, depth, seat_h, post + 0.01)
    rise = (post, post, back_h - seat_h + 0.02)
    meshes += [box(rise, (s * x, y, seat_h - 0.02)) for s in (-1, 1)]
    seat = [rounded_box((width, depth, draw.size(0.03, 0.07)), (0, 0, seat_h - 0.02), 0.02)]
    kind, span = draw.integer(0, 2), width - 2 * post
    if kind == 0:  # slats across
        heights = np.linspace(seat_h + 0.15, back_h - 0.08, draw.integer(2, 4))
        meshes += [box((span + post, 0.02, 0.06), (0, y, z)) for z in heights]
    elif kind == 1:  # spindles
        meshes.append(box((width, 0.03, 0.07), (0, y, back_h - 0.07)))
        places = np.linspace(-span / 2 + 0.03, span / 2 - 0.03, draw.integer(3, 5))
        meshes += [cylinder(0.011, back_h - seat_h - 0.05, (at, y, seat_h), 6) for at in places]
    else:  # a padded or solid back
        size = (span + post, 0.04, (back_h - seat_h) * draw.uniform(0.5, 0.8))
        seat.append(rounded_box(size, (0, y - 0.01, back_h - size[2]), 0.02))
    return assemble("chair", (frame, meshes), (cover, seat))


def _office_chair(draw: Sampler) -> Model:
    radius, seat_h = draw.sizes((0.27, 0.32), (0.45, 0.52))
    width, depth, back_h = draw.sizes((0.46, 0.54), (0.44, 0.5), (0.45, 0.65))
    metal, cover, wheel = draw.metal(), draw.upholstery(), draw.dark()
    turns = np.radians(np.arange(5) * 72 + 90)
    feet = [(radius * float(np.cos(turn)), radius * float(np.sin(turn))) for turn in turns]
    star = [rod((0, 0, 0.1), (x, y, 0.08), 0.022) for x, y in feet]
    castors = [knob(0.032, 0.03, (x, y + 0.015, 0.032), 8) for x, y in feet]
    column = cylinder(0.03, seat_h - 0.08, (0, 0, 0.08), 10)
    support = box((0.06, 0.025, back_h), (0, depth / 2 + 0.02, seat_h))
    back = (width * 0.92, 0.08, back_h * 0.75)
    pads = [
        rounded_box((width, depth, 0.09), (0, 0, seat_h), 0.045),
        rounded_box(back, (0, depth / 2 - 0.02, seat_h + 0.25), 0.04),
    ]
    if draw.chance(0.6):  # arms
        for x in (-(width / 2 + 0.03), width / 2 + 0.03):
            star.append(rod((x, 0.05, seat_h), (x, 0.05, seat_h + 0.2), 0.016))
            castors.append(box((0.06, 0.26, 0.03), (x, 0.0, seat_h + 0.2)))
    return assemble("chair", (metal, [*star, column, support]), (cover, pads), (wheel, castors))


def stool(draw: Sampler) -> Model:
    """A seat without back: a bar stool on a column or a low stool on legs."""
    cover = draw.upholstery()
    frame = draw.metal() if draw.chance(0.5) else draw.wood()
    radius, height = draw.size(0.17, 0.21), draw.choice(draw.sizes((0.42, 0.5), (0.62, 0.78)))
    if draw.chance(0.7):
        seat = cylinder(radius, 0.06, (0, 0, height - 0.06), 18)
    else:
        seat = rounded_box((radius * 2, radius * 2, 0.06), (0, 0, height - 0.06), 0.02)
    if height > 0.55 and draw.chance(0.5):
        meshes = [
            cylinder(0.03, height - 0.06, segments=10),
            cylinder(radius * 0.95, 0.03, segments=18),
            *_foot_ring(radius * 0.8, height * 0.35, spokes=True),
        ]
    else:
        meshes = legs(draw, radius * 2, radius * 2, height - 0.05, 0.04)
        meshes += _foot_ring(radius * 0.95, height * 0.35, spokes=False)
    return assemble("stool", (cover, [seat]), (frame, meshes))


def _foot_ring(radius: float, height: float, *, spokes: bool) -> list[Mesh]:
    ends = [(radius * x, radius * y, height) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    bars = [rod(ends[i], ends[(i + 1) % 4], 0.011, 6) for i in range(4)]
    return bars + [rod((0, 0, height), end, 0.011, 6) for end in ends if spokes]


def bench(draw: Sampler) -> Model:
    """A long seat without arms, of slats or padded, with or without a low shelf."""
    width, depth, height = draw.sizes((1.0, 1.4), (0.34, 0.42), (0.42, 0.48))
    wood, cover = draw.wood(), draw.upholstery()
    pads: list[Mesh] = []
    if draw.chance(0.5):
        count = draw.integer(3, 4)
        slat = depth / count
        size = (width, slat * 0.82, 0.035)
        meshes = [box(size, (0, y, height - 0.035)) for y in spread(count, slat)]
    else:
        meshes = [box((width, depth, 0.04), (0, 0, height - 0.1))]
        pads.append(rounded_box((width, depth, 0.07), (0, 0, height - 0.06), 0.03))
    if draw.chance(0.5):
        end = (0.05, depth, height - 0.06)
        meshes += [box(end, (s * (width / 2 - 0.1), 0, 0)) for s in (-1, 1)]
        meshes.append(box((width - 0.2, 0.03, 0.08), (0, 0, height * 0.3)))
    else:
        meshes += legs(draw, width - 0.1, depth, height - 0.05, 0.06)
    return assemble("bench", (wood, meshes), (cover, pads), tops=[top(width, depth, height)])


def bed(draw: Sampler) -> Model:
    """A single or double bed: headboard at the wall, mattress, a blanket over the lower part."""
    width = draw.choice(draw.sizes((0.9, 1.05), (1.4, 1.65), (1.4, 1.65)))
    length, frame_h = draw.sizes((1.95, 2.1), (0.2, 0.32))
    mattress_h, head_h = draw.sizes((0.18, 0.26), (0.75, 1.1))
    wood = draw.wood() if draw.chance(0.7) else draw.upholstery()
    leg = draw.size(0.05, 0.12)
    frame = [box((width, length, frame_h - leg), (0, 0, leg))]
    frame += legs(draw, width, length, leg + 0.01, 0.07)
    frame += _headboard(draw, width, head_h, length / 2)
    if draw.chance(0.35):
        frame.append(box((width, 0.05, frame_h + 0.25), (0, -length / 2 + 0.025, 0)))
    mattress = rounded_box((width - 0.06, length - 0.12, mattress_h), (0, 0, frame_h), 0.06)
    cover_l = length * draw.uniform(0.55, 0.72)
    at = (0, -length / 2 + cover_l / 2 + 0.06, frame_h + 0.02)
    blanket = rounded_box((width + 0.02, cover_l, mattress_h + 0.03), at, 0.07)
    x, z = width / 2 - 0.04, frame_h + mattress_h
    return assemble(
        "bed",
        (wood, frame),
        (draw.pale(), [mattress]),
        (draw.fabric(), [blanket]),
        tops=[Top(-x, length / 2 - 0.55, x, length / 2 - 0.12, z)],
    )


def _headboard(draw: Sampler, width: float, height: float, back: float) -> list[Mesh]:
    y, kind = back - 0.03, draw.integer(0, 2)
    if kind == 0:
        return [rounded_box((width, 0.07, height), (0, y, 0), 0.03)]
    posts = [box((0.06, 0.06, height), (s * (width / 2 - 0.03), y, 0)) for s in (-1, 1)]
    posts.append(box((width, 0.04, 0.08), (0, y, height - 0.1)))
    if kind == 1:
        places = np.linspace(-width / 2 + 0.12, width / 2 - 0.12, draw.integer(5, 9))
        return posts + [box((0.03, 0.025, height - 0.2), (x, y, 0.12)) for x in places]
    return posts + [box((width, 0.025, 0.1), (0, y, z)) for z in (height * 0.45, height * 0.65)]


def pillow(draw: Sampler) -> Model:
    """A pillow that lies or leans: two soft bulges with a seam."""
    width, depth, thick = draw.sizes((0.45, 0.65), (0.36, 0.45), (0.13, 0.18))
    cover = draw.fabric() if draw.chance(0.7) else draw.pale()
    u, v = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9), indexing="ij")
    bulge = ((1 - u**4) * (1 - v**4)) ** 0.5
    pinch = 1 - 0.12 * (1 - u**2) * v**2 - 0.12 * (1 - v**2) * u**2
    x, y = u * width / 2 * pinch, v * depth / 2 * pinch
    index = np.arange(81).reshape(9, 9)
    quads = (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:])
    a, b, c, d = (corner.ravel() for corner in quads)
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    halves = [np.stack([x, y, s * bulge * thick / 2], axis=-1).reshape(-1, 3) for s in (1, -1)]
    meshes = [from_faces(half, faces).translated(0, 0, thick / 2) for half in halves]
    return assemble("pillow", (cover, meshes))


def table(draw: Sampler) -> Model:
    """A dining table: rectangular on legs or trestles, or round on a pedestal."""
    height = draw.size(0.71, 0.77)
    if draw.chance(0.35):
        return _round_table(draw, "table", draw.size(0.45, 0.6), height)
    return _square_table(draw, "table", draw.size(1.1, 1.6), draw.size(0.75, 0.95), height)


def coffee_table(draw: Sampler) -> Model:
    """A low table in front of a sofa."""
    height = draw.size(0.36, 0.48)
    if draw.chance(0.35):
        return _round_table(draw, "coffee table", draw.size(0.32, 0.45), height)
    return _square_table(draw, "coffee table", draw.size(0.8, 1.15), draw.size(0.45, 0.6), height)


def _round_table(draw: Sampler, category: str, radius: float, height: float) -> Model:
    thickness = draw.size(0.03, 0.05)
    below, wide = height - thickness, radius * 1.35
    board = cylinder(radius, thickness, (0, 0, below), 24)
    if draw.chance(0.6):
        foot = radius * draw.size(0.5, 0.7)
        waist = draw.size(0.03, 0.07)
        profile = [(foot, 0), (foot, 0.03), (waist, 0.09), (waist, height - 0.12), (0.14, height)]
        support = [lathe([(r, z * below / height) for r, z in profile])]
    else:
        support = legs(draw, wide, wide, below, 0.06)
    boards = (draw.wood(), [board])
    return assemble(category, boards, (_frame(draw), support), tops=[top(wide, wide, height)])


def _square_table(draw: Sampler, category: str, width: float, depth: float, height: float) -> Model:
    thickness = draw.size(0.025, 0.05)
    below, kind = height - thickness, draw.integer(0, 3)
    board = [box((width, depth, thickness), (0, 0, below))]
    meshes: list[Mesh] = []
    if kind == 0:  # trestles
        foot, head, end = depth / 2 - 0.05, 0.08, width / 2 - 0.15
        for x in (-end, end):
            meshes.append(rod((x, -foot, 0.0), (x, head, below), 0.025))
            meshes.append(rod((x, foot, 0.0), (x, -head, below), 0.025))
        meshes.append(rod((-end, 0, below / 2), (end, 0, below / 2), 0.02))
    elif kind == 1:  # side panels
        side = (0.05, depth * 0.9, below)
        meshes += [box(side, (s * (width / 2 - 0.08), 0, 0)) for s in (-1, 1)]
    else:
        meshes += legs(draw, width, depth, below, draw.size(0.05, 0.08))
        apron = (width - 0.16, 0.02, 0.08)
        meshes += [box(apron, (0, s * (depth / 2 - 0.06), below - 0.08)) for s in (-1, 1)]
    if category == "coffee table" and draw.chance(0.5):
        board.append(box((width - 0.14, depth - 0.1, 0.02), (0, 0, height * 0.35)))
    frame, wood = _frame(draw), draw.wood()
    return assemble(category, (wood, board), (frame, meshes), tops=[top(width, depth, height)])


def _frame(draw: Sampler) -> Material:
    return draw.wood() if draw.chance(0.65) else draw.metal()


def desk(draw: Sampler) -> Model:
    """A table against a wall with drawers on one or both sides, open in front for the knees."""
    width, depth, height = draw.sizes((1.1, 1.5), (0.58, 0.7), (0.72, 0.77))
    wood, metal = draw.wood(), draw.metal()
    fronts = wood if draw.chance(0.5) else draw.wood()
    meshes = [
        box((width, depth, 0.035), (0, 0, height - 0.035)),
        box((width - 0.1, 0.02, 0.35), (0, depth / 2 - 0.05, height - 0.385)),
    ]
    sides = [-1, 1] if draw.chance(0.35) else [draw.choice([-1, 1])]
    chest_w = min(draw.size(0.34, 0.42), width / 3)
    drawers, handles = [], []
    for side in sides:
        x = side * (width / 2 - chest_w / 2 - 0.02)
        meshes.append(box((chest_w, depth - 0.06, height - 0.035), (x, 0, 0)))
        count = draw.integer(2, 4)
        tall = (height - 0.08) / count
        for z in (0.03 + index * tall for index in range(count)):
            at = (x, -depth / 2 + 0.022, z)
            drawers.append(rounded_box((chest_w - 0.03, 0.025, tall - 0.025), at, 0.006))
            handles.append(box((0.1, 0.025, 0.018), (x, -depth / 2, z + tall / 2)))
    if len(sides) == 1:
        x, y = -sides[0] * (width / 2 - 0.04), depth / 2 - 0.05
        meshes += [box((0.05, 0.05, height - 0.03), (x, s * y, 0)) for s in (-1, 1)]
    groups = (wood, meshes), (fronts, drawers), (metal, handles)
    return assemble("desk", *groups, tops=[top(width, depth - 0.1, height)])
