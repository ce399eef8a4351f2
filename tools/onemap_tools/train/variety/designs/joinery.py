"""Pieces of case furniture that several designs share: carcasses, leaves, grips, feet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    Vec,
    box,
    cone,
    cylinder,
    ellipsoid,
    from_faces,
    lathe,
    prism,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Model, SupportSurface
from onemap_simulator.generation.sampler import Sampler

LEAF_M = 0.022
Outline = list[tuple[float, float]]


def upright_board(outline: Outline, thickness: float, back_y: float) -> Mesh:
    """An outline of (x, z) points, star-shaped, as a board whose back is at ``back_y``."""
    return prism(outline, thickness).rotated("x", 90).translated(0, back_y)


def moulding(outline: Outline, width: float) -> Mesh:
    """An outline of (y, z) points drawn out along x, centred."""
    drawn = prism(outline, width).rotated("x", 90).rotated("z", 90)
    return drawn.translated(-width / 2, 0)


def case(size: Vec, board: float = 0.02, z: float = 0.0) -> list[Mesh]:
    """An open-fronted box of sides, lid, floor and back."""
    width, depth, height = size
    inner = width - 2 * board
    return [
        *(box((board, depth, height), (s * (width - board) / 2, 0, z)) for s in (-1, 1)),
        box((inner, depth, board), (0, 0, z)),
        box((inner, depth, board), (0, 0, z + height - board)),
        box((inner, 0.01, height - 2 * board), (0, depth / 2 - 0.007, z + board)),
    ]


def panelled(
    width: float, height: float, rows: int, rail: float = 0.07
) -> tuple[list[Mesh], list[Mesh]]:
    """A leaf of frame and recessed panels: its back at y = 0, its base at z = 0."""
    middle = -LEAF_M / 2
    frame = [box((rail, LEAF_M, height), (s * (width - rail) / 2, middle, 0)) for s in (-1, 1)]
    inner = width - 2 * rail
    cell = (height - rail) / rows
    frame += [box((inner, LEAF_M, rail), (0, middle, row * cell)) for row in range(rows + 1)]
    panels = [
        box((inner, 0.008, cell - rail), (0, -0.006, row * cell + rail)) for row in range(rows)
    ]
    return frame, panels


def shifted(meshes: list[Mesh], x: float, y: float, z: float = 0.0) -> list[Mesh]:
    """The meshes moved together."""
    return [mesh.translated(x, y, z) for mesh in meshes]


@dataclass(frozen=True, slots=True)
class Grip:
    """One kind of handle, to be set on every leaf of a piece."""

    kind: str
    length: float
    thick: float

    def at(self, x: float, y: float, z: float, *, upright: bool = True) -> list[Mesh]:
        """The handle around (x, z) on a front at ``y``."""
        return shifted(self._made(upright), x, y, z)

    def _made(self, upright: bool) -> list[Mesh]:
        t, half = self.thick, self.length / 2
        if self.kind == "knob":
            profile = [(t * 0.4, 0.0), (t * 0.35, t), (t, t * 1.4), (t * 0.8, t * 2.1)]
            return [lathe(profile, segments=10).rotated("x", 90)]
        if self.kind == "block":
            return [rounded_box((t * 2, t * 2, t * 2), (0, -t, -t), t * 0.4)]
        if self.kind == "ring":
            ring = torus(t * 1.3, t * 0.25, segments=10).rotated("x", 80)
            return [ring.translated(0, -t * 0.9, -t), ellipsoid((t * 0.7, t, t * 0.7), segments=8)]
        if self.kind == "bow":
            turn = np.linspace(0, np.pi, 9)
            arc = np.stack([half * np.cos(turn), -0.035 * np.sin(turn), 0 * turn], axis=1)
            mesh = [tube(arc, t * 0.3)]
        elif self.kind == "rail":
            mesh = [rod((-half, -0.035, 0), (half, -0.035, 0), t * 0.35)]
            mesh += [
                rod((s * half * 0.8, 0, 0), (s * half * 0.8, -0.035, 0), t * 0.3) for s in (-1, 1)
            ]
        else:
            mesh = [box((self.length, 0.02, t), (0, -0.01, -t / 2))]
        return [m.rotated("y", 90) for m in mesh] if upright else mesh


def grip(sampler: Sampler, low: float = 0.1, high: float = 0.35) -> Grip:
    """A kind of handle with its size."""
    kind = sampler.choice(["knob", "block", "ring", "bow", "rail", "strip"])
    return Grip(kind, sampler.uniform(low, high), sampler.uniform(0.014, 0.024))


def feet(sampler: Sampler, width: float, depth: float, height: float) -> list[Mesh]:
    """Four feet: buns, brackets, tapered, turned or sledge runners."""
    kind = sampler.integer(0, 4)
    t = sampler.uniform(0.02, 0.035) + height * 0.06
    x, y = width / 2 - t * 1.2, depth / 2 - t * 1.2
    corners = [(sx * x, sy * y) for sx in (-1, 1) for sy in (-1, 1)]
    if height < t * 2:
        kind = 1
    if kind == 0:
        bun = lathe(
            [(t * 0.6, 0.0), (t * 1.15, height * 0.4), (t * 0.9, height * 0.8), (t, height)]
        )
        return [bun.translated(*at) for at in corners]
    if kind == 1:
        return [box((t * 2, t * 2, height), (*at, 0)) for at in corners]
    if kind == 2:
        return [cone((t * 0.5, t), height, (*at, 0), 10) for at in corners]
    if kind == 3:
        return [splayed(ax, ay, height, t * 0.6) for ax, ay in corners]
    runners = [box((t, depth, t * 0.8), (s * x, 0, 0)) for s in (-1, 1)]
    return runners + [cylinder(t * 0.45, height - t * 0.8, (*at, t * 0.8), 8) for at in corners]


def splayed(x: float, y: float, height: float, radius: float) -> Mesh:
    """A round leg that stands flat at (x, y) and leans inwards to its top."""
    leg = cone((radius * 0.7, radius), height, (x, y, 0), 8)
    lean = 1 - 0.15 * leg.vertices[:, 2:] / height
    return from_faces(leg.vertices * np.hstack([lean, lean, np.ones_like(lean)]), leg.faces)


def garments(sampler: Sampler, width: float, depth: float, height: float) -> list[Mesh]:
    """Clothes side by side on hangers, across x, hanging down from z = 0."""
    meshes, x = [], -width / 2
    while x < width / 2 - 0.03:
        thick = min(sampler.uniform(0.02, 0.07), width / 2 - x)
        if sampler.chance(0.85):
            drop = height * sampler.uniform(0.5, 1.0)
            half = depth / 2 * sampler.uniform(0.75, 1.0)
            hem = half * sampler.uniform(0.7, 1.0)
            outline = [(-hem, -drop), (hem, -drop), (half, -0.12), (0.04, -0.03), (-0.04, -0.03)]
            outline.append((-half, -0.12))
            meshes.append(moulding(outline, thick - 0.006).translated(x + thick / 2, 0))
        x += thick
    return meshes


def folded(sampler: Sampler, width: float, depth: float, height: float) -> list[Mesh]:
    """A pile of folded cloths, at most ``height``, on z = 0."""
    meshes: list[Mesh] = []
    z = 0.0
    while z < height - 0.05 and len(meshes) < sampler.integer(3, 7):
        thick = sampler.uniform(0.025, 0.05)
        y, soft = depth / 2 * sampler.uniform(0.85, 1.0), thick * 0.4
        fold = [(soft - y, 0.0), (y, 0.0), (y, thick), (soft - y, thick), (-y, thick / 2)]
        meshes.append(moulding(fold, width * sampler.uniform(0.85, 1.0)).translated(0, 0, z))
        z += thick + 0.001
    return meshes


def settled(model: Model) -> Model:
    """The model moved so that its box stands on z = 0, centred."""
    x, y, _ = (-(model.lower + model.upper) / 2).tolist()
    z = -float(model.lower[2])
    parts = tuple(part._replace(mesh=part.mesh.translated(x, y, z)) for part in model.parts)
    tops = tuple(
        SupportSurface(s.x_min + x, s.y_min + y, s.x_max + x, s.y_max + y, s.z + z)
        for s in model.support_surfaces
    )
    return Model(model.category, parts, tops)
