"""Chairs of one shell, of bent plywood, of bentwood and with a ladder back."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, cylinder, rod, torus
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.seat_shapes import (
    SIDES,
    bent,
    corners,
    cushion,
    grounded,
    outline,
    sheet,
    slab,
    standing,
    strip,
    swept,
    turned,
)


def _shell_grid(size: tuple[float, float, float], seat_h: float, waist: float, curl: float) -> F64:
    """Points of a seat that bends up into its back: width, depth and height of the shell."""
    width, depth, rise = size
    profile = bent(
        [
            (0, -depth / 2, seat_h - 0.035),
            (0, -depth / 2 + 0.05, seat_h + 0.005),
            (0, depth / 2 - 0.1, seat_h - 0.02),
            (0, depth / 2, seat_h + rise),
        ],
        0.13,
        5,
    )
    along = np.linspace(0, 1, len(profile))
    corner = (1 - np.abs(2 * along - 1) ** 5 * 0.38) * (
        1 - waist * np.exp(-(((along - 0.58) / 0.11) ** 2))
    )
    across = np.linspace(-1, 1, 9)
    grid = np.empty((len(profile), 9, 3))
    grid[..., 0] = np.outer(corner * width / 2, across)
    lean = np.clip((along - 0.45) / 0.25, 0, 1)
    lift = curl * across**2
    grid[..., 1] = profile[:, 1, None] - np.outer(lean, lift)
    grid[..., 2] = profile[:, 2, None] + np.outer(1 - lean, lift)
    return grid[:, ::-1]


def _shell_base(sampler: Sampler, reach: float, seat_h: float) -> list[Mesh]:
    kind, top = sampler.choice(["dowel", "wire", "sled", "tube"]), seat_h - 0.03
    feet = corners(reach * 2, reach * 2)
    if kind == "sled":
        return [
            swept(
                bent(
                    [
                        (s * reach * 0.55, -0.1, top),
                        (s * reach, -reach, 0.011),
                        (s * reach, reach, 0.011),
                        (s * reach * 0.55, 0.12, top),
                    ],
                    0.05,
                ),
                0.011,
            )
            for s in SIDES
        ] + [rod((-reach * 0.55, y, top), (reach * 0.55, y, top), 0.01) for y in (-0.1, 0.12)]
    thick = (0.012, 0.019) if kind == "dowel" else (0.011, 0.011)
    meshes = [grounded((x, y, 0), (x * 0.6, y * 0.55, top), thick) for x, y in feet]
    inner = [(x * 0.6, y * 0.55) for x, y in feet]
    order = [0, 1, 3, 2]
    for a, b in zip(order, order[1:] + order[:1], strict=True):
        meshes.append(rod((*inner[a], top - 0.008), (*inner[b], top - 0.008), 0.01))
        if kind == "wire":
            low = (feet[b][0] * 0.8, feet[b][1] * 0.78, top * 0.5)
            meshes.append(rod((*inner[a], top - 0.01), low, 0.005, 6))
            low = (feet[a][0] * 0.8, feet[a][1] * 0.78, top * 0.5)
            meshes.append(rod((*inner[b], top - 0.01), low, 0.005, 6))
    return meshes


def shell_chair(sampler: Sampler) -> Model:
    """A one-piece moulded shell on dowel, wire, sled or tube legs."""
    seat_h = sampler.size(0.42, 0.47)
    size = (sampler.size(0.42, 0.52), sampler.size(0.44, 0.52), sampler.size(0.32, 0.45))
    shell = sampler.plastic() if sampler.chance(0.7) else sampler.upholstery()
    grid = _shell_grid(size, seat_h, sampler.uniform(-0.05, 0.12), sampler.uniform(0.03, 0.1))
    meshes = [sheet(grid, sampler.uniform(0.01, 0.03))]
    base = sampler.wood() if sampler.chance(0.5) else sampler.metal()
    pads = []
    if sampler.chance(0.3):
        pads = [cushion(outline(0.36, 0.34, 0.36, 3.0), 0.04, (0, -0.04, seat_h - 0.01))]
    legs = _shell_base(sampler, sampler.size(0.19, 0.24), seat_h)
    return standing("chair", (shell, meshes), (base, legs), (sampler.fabric(), pads))


def plywood_chair(sampler: Sampler) -> Model:
    """A bent plywood seat with a narrow waist, on thin bent tube legs."""
    seat_h = sampler.size(0.42, 0.46)
    size = (sampler.size(0.44, 0.5), sampler.size(0.44, 0.5), sampler.size(0.32, 0.4))
    grid = _shell_grid(size, seat_h, sampler.uniform(0.4, 0.62), sampler.uniform(0.0, 0.035))
    reach = sampler.size(0.2, 0.24)
    top = seat_h - 0.032
    legs = [
        swept(
            bent(
                [(-reach, y, 0.0), (-0.12, y * 0.5, top), (0.12, y * 0.5, top), (reach, y, 0.0)],
                0.06,
            ),
            0.009,
        )
        for y in (-reach, reach)
    ]
    plate = cylinder(0.1, 0.025, (0, 0, top - 0.005), 14)
    feet = [cylinder(0.014, 0.02, (x, y, 0.0), 8) for x, y in corners(2 * reach, 2 * reach)]
    return standing(
        "chair",
        (sampler.wood(), [sheet(grid, 0.012)]),
        (sampler.metal(), [*legs, plate]),
        (sampler.dark(), feet),
    )


def cafe_chair(sampler: Sampler) -> Model:
    """A bentwood cafe chair: round seat, looped back, splayed legs and a hoop between them."""
    seat_h, back_h = sampler.size(0.44, 0.47), sampler.size(0.82, 0.95)
    radius = sampler.size(0.19, 0.22)
    thick = sampler.size(0.013, 0.017)
    wood = sampler.wood()
    meshes = [torus(radius, 0.02, (0, 0, seat_h - 0.02), 24)]
    foot, hip = radius * 0.95, radius * 0.78
    meshes += [
        grounded(
            (s * foot, -foot, 0),
            (s * hip * 0.85, -hip * 0.8, seat_h - 0.02),
            (thick * 0.8, thick * 1.3),
        )
        for s in SIDES
    ]
    meshes.append(swept(_hoop(foot, hip, seat_h, back_h), thick))
    if sampler.chance(0.7):
        inner = sampler.uniform(0.5, 0.7)
        path = _hoop(foot, hip, seat_h, back_h)[3:-3] * (inner, 1, 1)
        path[:, 2] = seat_h - 0.03 + (path[:, 2] - path[:, 2].min()) * sampler.uniform(0.8, 0.9)
        path[:, 1] = hip * 0.82 + (path[:, 2] - seat_h + 0.03) * 0.2
        meshes.append(swept(path, thick * 0.8))
    else:
        for x in np.linspace(-0.08, 0.08, sampler.integer(2, 5)):
            end = (float(x), hip + 0.075, back_h - 0.02)
            meshes.append(rod((float(x) * 0.9, hip * 0.8, seat_h - 0.02), end, thick * 0.6))
    if sampler.chance(0.75):
        meshes.append(
            torus(radius * 0.85, thick * 0.7, (0, 0, seat_h * sampler.uniform(0.45, 0.6)), 20)
        )
    seat = [cylinder(radius - 0.012, 0.012, (0, 0, seat_h - 0.015), 22)]
    if sampler.chance(0.3):
        seat = [
            cushion(outline(radius * 2, radius * 2, radius * 2, 2.0), 0.05, (0, 0, seat_h - 0.01))
        ]
    cover = wood if sampler.chance(0.4) else sampler.upholstery()
    return standing("chair", (wood, meshes), (cover, seat))


def _hoop(foot: float, hip: float, seat_h: float, back_h: float) -> F64:
    """One bent rod: a rear leg, over the back, and down the other rear leg."""
    wide, deep, top = foot * 0.95, hip + 0.08, back_h
    return bent(
        [
            (-foot, foot * 1.05, 0.0),
            (-hip * 0.9, hip * 0.75, seat_h),
            (-wide, deep, top),
            (wide, deep, top),
            (hip * 0.9, hip * 0.75, seat_h),
            (foot, foot * 1.05, 0.0),
        ],
        0.16,
        6,
    )


def ladder_back(sampler: Sampler) -> Model:
    """A tall ladder back of curved slats, a woven seat and rungs between the legs."""
    width, depth = sampler.size(0.42, 0.5), sampler.size(0.38, 0.45)
    seat_h, back_h = sampler.size(0.42, 0.46), sampler.size(0.92, 1.15)
    post, lean = sampler.size(0.016, 0.022), sampler.uniform(0.02, 0.08)
    x, y = width / 2 - post, depth / 2 - post
    inner = x * sampler.uniform(0.82, 1.0)
    meshes = [cylinder(post, seat_h + 0.015, (s * x, -y, 0)) for s in SIDES]
    knob = [(post, 0.0), (post, 0.93), (post * 0.6, 0.95), (post * 1.25, 0.97), (post * 0.7, 1.0)]
    posts = [(post, 0.0), (post, 1.0)] if sampler.chance(0.4) else knob
    for s in SIDES:
        meshes.append(cylinder(post, seat_h, (s * inner, y, 0), 10))
        meshes.append(turned((s * inner, y, seat_h - 0.01), (s * inner, y + lean, back_h), posts))
    count = sampler.integer(3, 5)
    slat = min(sampler.uniform(0.045, 0.09), (back_h - seat_h - 0.2) / count * 0.65)
    for height in np.linspace(seat_h + 0.12, back_h - slat - 0.07, count):
        at = y + lean * (float(height) - seat_h) / (back_h - seat_h)
        ends = (-inner, at, float(height)), (inner, at, float(height))
        meshes.append(strip(*ends, slat, sampler.uniform(0.015, 0.03), 0.012))
    for level in np.linspace(0.3, 0.7, sampler.integer(1, 2)) * seat_h:
        z = float(level)
        meshes += [rod((-x, -y, z), (x, -y, z), 0.01), rod((-inner, y, z), (inner, y, z), 0.01)]
        meshes += [rod((s * x, -y, z + 0.03), (s * inner, y, z + 0.03), 0.01) for s in SIDES]
    shape = outline(width, 2 * inner + 2 * post, depth, 7.0)
    seat = [slab(shape, 0.035, (0, 0, seat_h - 0.03), 0.4)]
    cover = sampler.fabric() if sampler.chance(0.7) else sampler.wood()
    return standing("chair", (sampler.wood(), meshes), (cover, seat))


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "chair": (shell_chair, plywood_chair, cafe_chair, ladder_back)
}
