"""Other shapes of the same thing: proportions, rounded or leaning bodies, parts of another.

Functions of a model in its local frame: base at z = 0, back at +y (see ``generation.model``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, from_faces, rounded_box
from onemap_simulator.generation.model import Material, Model, Part

Warp = Callable[[F64, np.random.Generator], F64]  # vertices within the unit box to the same

BOX_CORNERS = 8  # a mesh with so many vertices is a box
SOFT_SHARE = (0.1, 0.49)  # of a box's thinnest side: radius of rounded edges


def rescaled(model: Model, rng: np.random.Generator, spread: float, *, upright: bool) -> Model:
    """Scaled by exp(N(0, spread)) along x and y, with ``upright`` along z; the back stays."""
    x, y, z = np.exp(np.clip(rng.normal(0, spread, 3), -2 * spread, 2 * spread))
    back = float(model.upper[1])
    factors = np.array([x, y, z if upright else 1.0])
    shift = np.array([0.0, back * (1 - y), 0.0])
    return _map_vertices(model, lambda vertices: vertices * factors + shift)


def with_part_sizes(model: Model, rng: np.random.Generator, spread: float) -> Model:
    """The parts of each material scaled about their own middle, along x and y."""
    factors: dict[int, tuple[F64, F64]] = {}
    for material in {id(part.material): part.material for part in model.parts}.values():
        points = np.concatenate([p.mesh.vertices for p in model.parts if p.material is material])
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        scale = np.append(np.exp(rng.uniform(-spread, spread, 2)), 1.0)
        factors[id(material)] = (scale, middle * (1 - scale))
    parts = []
    for part in model.parts:
        scale, shift = factors[id(part.material)]
        moved = replace(part.mesh, vertices=part.mesh.vertices * scale + shift)
        parts.append(Part(moved, part.material))
    return replace(model, parts=tuple(parts))


def softened(model: Model, rng: np.random.Generator) -> Model:
    """Boxes with rounded edges in place of sharp ones; panels and other meshes as they were."""
    share = rng.uniform(*SOFT_SHARE)
    parts = [
        Part(_rounded(part.mesh, share), part.material) if _is_box(part.mesh) else part
        for part in model.parts
    ]
    return replace(model, parts=tuple(parts))


def warped(model: Model, rng: np.random.Generator, warp: Warp) -> Model:
    """All vertices through ``warp``, which sees x, y in -1 to 1 and z in 0 to 1 of the box."""
    lower, upper = model.lower, model.upper
    half = np.maximum((upper - lower) / (2, 2, 1), 1e-6)
    middle = np.array([(lower[0] + upper[0]) / 2, (lower[1] + upper[1]) / 2, lower[2]])
    # One draw for all parts, so that they stay together.
    seed = int(rng.integers(2**31))

    def apply(vertices: F64) -> F64:
        unit = (vertices - middle) / half
        result: F64 = warp(unit, np.random.default_rng(seed)) * half + middle
        return result

    return _map_vertices(model, apply)


def recombined(model: Model, donor: Model, rng: np.random.Generator) -> Model:
    """Some groups of parts replaced by those of another model of its kind, fitted to their box.

    The groups are those of one material, in order; models of another number of groups as given.
    """
    own, other = _groups(model), _groups(donor)
    if len(own) != len(other):
        return model
    parts: list[Part] = []
    for mine, theirs in zip(own, other, strict=True):
        swap = len(own) > 1 and rng.random() < 0.5
        parts += fitted(theirs, box_of(mine), mine[0].material) if swap else mine
    return replace(model, parts=tuple(parts))


def fitted(parts: list[Part], box: F64, material: Material) -> list[Part]:
    """The parts stretched to a box (2, 3), all of one material."""
    inner = box_of(parts)
    scale = (box[1] - box[0]) / np.maximum(inner[1] - inner[0], 1e-6)
    return [
        Part(replace(p.mesh, vertices=(p.mesh.vertices - inner[0]) * scale + box[0]), material)
        for p in parts
    ]


def box_of(parts: list[Part]) -> F64:
    """Lower and upper corner (2, 3) of the parts."""
    points = np.concatenate([part.mesh.vertices for part in parts])
    return np.stack([points.min(axis=0), points.max(axis=0)])


def taper(unit: F64, rng: np.random.Generator) -> F64:
    """Narrower or wider towards the top."""
    wide = 1 + rng.uniform(-0.2, 0.2) * (unit[:, 2:] - 0.5)
    return np.concatenate([unit[:, :2] * wide, unit[:, 2:]], axis=1)


def lean(unit: F64, rng: np.random.Generator) -> F64:
    """Shifted sideways in proportion to height."""
    return np.asarray(unit + unit[:, 2:] * np.append(rng.uniform(-0.15, 0.15, 2), 0.0))


def twist(unit: F64, rng: np.random.Generator) -> F64:
    """Turned about the upright axis, the more the higher."""
    angle = rng.uniform(-0.35, 0.35) * unit[:, 2]
    c, s = np.cos(angle), np.sin(angle)
    x, y = unit[:, 0], unit[:, 1]
    return np.stack([c * x - s * y, s * x + c * y, unit[:, 2]], axis=1)


def bow(unit: F64, rng: np.random.Generator) -> F64:
    """Squared proportions: slim in the middle of the width or full, bent to the front."""
    power = np.exp(rng.uniform(-0.3, 0.3))
    x = np.sign(unit[:, 0]) * np.abs(unit[:, 0]) ** power
    y = unit[:, 1] - rng.uniform(0, 0.25) * (1 - np.minimum(unit[:, 0] ** 2, 1))
    return np.stack([x, y, np.maximum(unit[:, 2], 0) ** power], axis=1)


def _map_vertices(model: Model, change: Callable[[F64], F64]) -> Model:
    parts = tuple(
        Part(replace(part.mesh, vertices=change(part.mesh.vertices)), part.material)
        for part in model.parts
    )
    return replace(model, parts=parts)


def _groups(model: Model) -> list[list[Part]]:
    """Parts by material, in the order of the materials."""
    groups: dict[int, list[Part]] = {}
    for part in model.parts:
        groups.setdefault(id(part.material), []).append(part)
    return list(groups.values())


def _is_box(mesh: Mesh) -> bool:
    if len(mesh.vertices) != BOX_CORNERS:
        return False
    lower, upper = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    at_corner = np.isclose(mesh.vertices, lower) | np.isclose(mesh.vertices, upper)
    return bool(at_corner.all())


def _rounded(mesh: Mesh, share: float) -> Mesh:
    """The axis-aligned box with edges rounded by a share of its thinnest side."""
    lower, upper = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    size = upper - lower
    x, y = (lower[:2] + upper[:2]) / 2
    soft = rounded_box(tuple(size.tolist()), (x, y, lower[2]), float(share * size.min()))
    return from_faces(soft.vertices, soft.faces)
