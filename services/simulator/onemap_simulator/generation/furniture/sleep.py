"""Beds and pillows."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.furniture.seating import legs
from onemap_simulator.generation.mesh import Mesh, box, from_faces, rounded_box
from onemap_simulator.generation.model import Model, SupportSurface, assemble
from onemap_simulator.generation.sampler import Sampler


def bed(sampler: Sampler) -> Model:
    """A single or double bed: headboard at the wall, mattress, a blanket over the lower part."""
    width = sampler.choice(
        [sampler.size(0.9, 1.05), sampler.size(1.4, 1.65), sampler.size(1.4, 1.65)]
    )
    length, frame_h = sampler.size(1.95, 2.1), sampler.size(0.2, 0.32)
    mattress_h, head_h = sampler.size(0.18, 0.26), sampler.size(0.75, 1.1)
    wood = sampler.wood() if sampler.chance(0.7) else sampler.upholstery()
    leg = sampler.size(0.05, 0.12)
    frame = [box((width, length, frame_h - leg), (0, 0, leg))]
    frame += legs(sampler, width, length, leg + 0.01, 0.07)
    frame += _headboard(sampler, width, head_h, length / 2)
    if sampler.chance(0.35):
        frame.append(box((width, 0.05, frame_h + 0.25), (0, -length / 2 + 0.025, 0)))
    mattress = rounded_box((width - 0.06, length - 0.12, mattress_h), (0, 0, frame_h), 0.06)
    cover_l = length * sampler.uniform(0.55, 0.72)
    blanket = rounded_box(
        (width + 0.02, cover_l, mattress_h + 0.03),
        (0, -length / 2 + cover_l / 2 + 0.06, frame_h + 0.02),
        0.07,
    )
    top = frame_h + mattress_h
    support_surfaces = (
        SupportSurface(
            -width / 2 + 0.04, length / 2 - 0.55, width / 2 - 0.04, length / 2 - 0.12, top
        ),
    )
    return assemble(
        "bed",
        (wood, frame),
        (sampler.pale(), [mattress]),
        (sampler.fabric(), [blanket]),
        support_surfaces=support_surfaces,
    )


def _headboard(sampler: Sampler, width: float, height: float, back: float) -> list[Mesh]:
    y, kind = back - 0.03, sampler.integer(0, 2)
    if kind == 0:
        return [rounded_box((width, 0.07, height), (0, y, 0), 0.03)]
    posts: list[Mesh] = [
        box((0.06, 0.06, height), (side * (width / 2 - 0.03), y, 0)) for side in (-1, 1)
    ]
    posts.append(box((width, 0.04, 0.08), (0, y, height - 0.1)))
    if kind == 1:
        for x in np.linspace(-width / 2 + 0.12, width / 2 - 0.12, sampler.integer(5, 9)):
            posts.append(box((0.03, 0.025, height - 0.2), (float(x), y, 0.12)))
    else:
        for z in (height * 0.45, height * 0.65):
            posts.append(box((width, 0.025, 0.1), (0, y, z)))
    return posts


def pillow(sampler: Sampler) -> Model:
    """A pillow that lies or leans: two soft bulges with a seam."""
    width, depth, thick = (
        sampler.size(0.45, 0.65),
        sampler.size(0.36, 0.45),
        sampler.size(0.13, 0.18),
    )
    cover = sampler.fabric() if sampler.chance(0.7) else sampler.pale()
    u, v = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9), indexing="ij")
    bulge = ((1 - u**4) * (1 - v**4)) ** 0.5
    pinch = 1 - 0.12 * (1 - u**2) * v**2 - 0.12 * (1 - v**2) * u**2
    x, y = u * width / 2 * pinch, v * depth / 2 * pinch
    meshes = [_sheet(x, y, side * bulge * thick / 2) for side in (1, -1)]
    return assemble("pillow", (cover, [mesh.translated(0, 0, thick / 2) for mesh in meshes]))


def _sheet(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> Mesh:
    index = np.arange(x.size).reshape(x.shape)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    quads = np.stack([a, b, c, d], axis=-1).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return from_faces(np.stack([x, y, z], axis=-1).reshape(-1, 3), faces)
