"""What a surface looks like: a texture and how it reflects light."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from onemap_shared.geometry import F64, U8
from onemap_tools.foreign.plain_mesh import PlainMesh


@dataclass(frozen=True, slots=True, eq=False)
class Finish:
    """A material.

    texture (h, w, 3) uint8 RGB, ``repeat_m`` metres wide and high. ``gloss``, 0 to 1: strength of
    highlights; ``sharpness``: exponent of their cosine; ``mirror``, 0 to 1: share of a sharp
    reflection; ``glow``, 0 to 1: share of light of its own. ``metal``: highlights have its colour.
    """

    texture: U8
    repeat_m: float = 0.6
    gloss: float = 0.04
    sharpness: float = 20.0
    mirror: float = 0.0
    glow: float = 0.0
    metal: bool = False

    def over(self, repeat_m: float) -> Finish:
        """The same with a texture of another size."""
        return replace(self, repeat_m=repeat_m)


@dataclass(frozen=True, slots=True, eq=False)
class FinishedPart:
    """A mesh with a finish; uv (F, 3, 2) texture coordinates of the corners, v downwards."""

    mesh: PlainMesh
    uv: F64
    finish: Finish


def finished(mesh: PlainMesh, finish: Finish, upright: bool | None = None) -> FinishedPart:
    """Texture coordinates from the axis that each triangle faces; ``upright`` turns the grain.

    The grain lies along x on faces that look along y or z, and along y on the others. Without
    ``upright`` it stands on meshes of which most is slender and high, such as legs.
    """
    corners = mesh.vertices[mesh.faces]
    if upright is None:
        reach = np.ptp(corners, axis=1).sum(axis=0)
        upright = bool(reach[2] > 1.2 * reach[:2].max())
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    axis = np.abs(normal).argmax(axis=1)
    across, up = np.array([1, 0, 0])[axis], np.array([2, 2, 1])[axis]
    u = np.take_along_axis(corners, across[:, None, None], axis=2)[..., 0]
    v = np.take_along_axis(corners, up[:, None, None], axis=2)[..., 0]
    uv = np.stack([v, u] if upright else [u, -v], axis=-1) / finish.repeat_m
    return FinishedPart(mesh, uv, finish)


def pictured(width: float, height: float, finish: Finish) -> FinishedPart:
    """A flat picture that looks along -y, its lower edge at z = 0, shown once and whole."""
    w = width / 2
    vertices = np.array([[-w, 0, 0], [w, 0, 0], [w, 0, height], [-w, 0, height]], np.float64)
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int64)
    corner_uv = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]])
    return FinishedPart(PlainMesh(vertices, faces), corner_uv[faces], finish)
