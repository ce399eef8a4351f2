"""A model: the meshes of one object of a category, each with its material.

Local frame: metres, z up, the base at z = 0, width along x, the front towards -y and the
back towards +y, where a wall would be.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from onemap_shared.geometry import F64, U8
from onemap_simulator.generation.mesh import Mesh


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """An albedo texture (h, w, 3) uint8 RGB that repeats every ``tile_m`` metres.

    A panel's uv runs from 0 to 1, so its material has ``tile_m`` 1. Compared by identity.
    """

    texture: U8
    tile_m: float = 1.0


class Part(NamedTuple):
    """A mesh and its material."""

    mesh: Mesh
    material: Material


class SupportSurface(NamedTuple):
    """A horizontal rectangle in the local frame, metres, on which small objects may stand."""

    x_min: float
    y_min: float
    x_max: float
    y_max: float
    z: float


@dataclass(frozen=True, slots=True)
class Model:
    """One object in its local frame."""

    category: str
    parts: tuple[Part, ...]
    support_surfaces: tuple[SupportSurface, ...] = ()

    @property
    def lower(self) -> F64:
        """The smallest x, y, z (3,) in metres."""
        least: F64 = np.min([part.mesh.vertices.min(axis=0) for part in self.parts], axis=0)
        return least

    @property
    def upper(self) -> F64:
        """The largest x, y, z (3,) in metres."""
        most: F64 = np.max([part.mesh.vertices.max(axis=0) for part in self.parts], axis=0)
        return most


def assemble(
    category: str,
    *groups: tuple[Material, list[Mesh]],
    support_surfaces: tuple[SupportSurface, ...] = (),
) -> Model:
    """A model from groups of meshes that share a material."""
    parts = tuple(Part(mesh, material) for material, meshes in groups for mesh in meshes)
    return Model(category, parts, support_surfaces)


def support_surface(width: float, depth: float, z: float, margin: float = 0.04) -> SupportSurface:
    """A support surface centred on the local origin, with a margin to its edges."""
    x, y = max(width / 2 - margin, 0.01), max(depth / 2 - margin, 0.01)
    return SupportSurface(-x, -y, x, y, z)
