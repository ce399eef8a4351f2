"""Irradiance of surfaces: hemispheric ambient light and point lights.

The visibility of every light is ray-traced once when the scene is loaded, on a 2-D
grid, and blurred: lamps do not shine through walls, and doorways get a soft edge.
Only the two strongest lights of an image cast shadows of objects, traced for a
quarter of its pixels; more would cost the frame rate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from onemap_shared.geometry import F32, F64, Bool
from onemap_shared.grid import GridSpec
from onemap_simulator.scene.scene import Scene

Occluded = Callable[[F32, F32], Bool]  # from (N, 3), to (N, 3) -> (N,) whether something is between

CELL_SIZE_M = 0.1  # finer than a wall is thick
PROBE_HEIGHTS_M = (0.4, 1.0, 1.6, 2.1)  # the share of these that see a light is its visibility
BLUR_CELLS = 3  # soft edges of 0.3 m, as from a lamp with a shade
SURFACE_OFFSET_M = 0.15  # visibility is read so far in front of a surface, not inside its wall
HALF_DISTANCE_M = 2.0  # a light has half its strength here: between a bulb and a bright ceiling
HEMISPHERE = 0.25  # surfaces that face up get this much more ambient light, down this much less
NEGLIGIBLE = 0.01  # of full visibility
SHADOW_CASTERS = 2
SHADOW = 0.35  # share of a light that still arrives in its shadow, reflected by walls
LIFT_M = 0.01  # shadow rays start this far above their surface, so it does not shade itself


@dataclass(frozen=True, slots=True)
class LightMap:
    """The lights of a scene and the visibility of each.

    positions, colours (L, 3) float32; visibility (L, nx, ny) float32 in [0, 1] over ``grid``;
    ambient (3,) float32; occluded: ray test between points.
    """

    positions: F32
    colours: F32
    ambient: F32
    grid: GridSpec
    visibility: F32
    occluded: Occluded

    @classmethod
    def of(cls, scene: Scene, occluded: Occluded) -> LightMap:
        """Trace the visibility of each light from every cell."""
        lower, upper = scene.vertices.min(axis=0), scene.vertices.max(axis=0)
        grid = GridSpec.covering(CELL_SIZE_M, (lower[0], lower[1]), (upper[0], upper[1]))
        positions = np.array([light.position_m for light in scene.lights], np.float32)
        colours = np.array([light.colour for light in scene.lights], np.float32)
        positions, colours = positions.reshape(-1, 3), colours.reshape(-1, 3)
        seen = [_seen_from(position, grid, occluded) for position in positions]
        visibility = _blurred(seen, grid.shape)
        ambient = np.array(scene.ambient, np.float32)
        return cls(positions, colours, ambient, grid, visibility, occluded)

    def irradiance(self, points: F32, normals: F32) -> F32:
        """Irradiance (3, H, W) float32 at points (3, H, W) metres with unit normals (3, H, W).

        1 shows an albedo unchanged.
        """
        hemisphere = 1.0 + HEMISPHERE * normals[2]
        total: F32 = self.ambient[:, None, None] * hemisphere
        weights = self._weights(points, normals)
        strongest = sorted(weights, key=lambda light: -float(weights[light].sum()))
        for rank, light in enumerate(strongest):
            weight = weights[light]
            if rank < SHADOW_CASTERS:
                weight *= self._unshadowed(self.positions[light], points, normals, weight)
            for channel in range(3):
                total[channel] += weight * self.colours[light, channel]
        return total

    def _weights(self, points: F32, normals: F32) -> dict[int, F32]:
        """Unshadowed weight (H, W) of each light that is not negligible in this image."""
        size = np.float32(self.grid.cell_size_m)
        # cv2.remap reads (column, row) = (iy, ix), with integers at cell centres.
        rows, columns = (
            (points[axis] + SURFACE_OFFSET_M * normals[axis]) / size
            - np.float32(self.grid.origin_cell[axis] + 0.5)
            for axis in (0, 1)
        )
        weights = {}
        for light, position in enumerate(self.positions):
            seen = self.visibility[light, :, :]
            weight: F32 = np.asarray(
                cv2.remap(seen, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE),
                np.float32,
            )
            if weight.max() < NEGLIGIBLE:
                continue
            x, y, z = (position[axis] - points[axis] for axis in range(3))
            squared = x * x + y * y + z * z
            facing = x * normals[0] + y * normals[1] + z * normals[2]
            weight *= np.maximum(facing, 0.0)
            weight /= np.sqrt(squared + 1e-6) * (1.0 + squared / HALF_DISTANCE_M**2)
            weights[light] = weight
        return weights

    def _unshadowed(self, position: F32, points: F32, normals: F32, weight: F32) -> F32:
        """Share (H, W) of a light after shadows; traced for every other row and column."""
        coarse = np.s_[..., ::2, ::2]
        matters = weight[coarse] > NEGLIGIBLE
        starts = (points[coarse] + LIFT_M * normals[coarse])[:, matters].T
        share = np.ones(matters.shape, np.float32)
        blocked = self.occluded(starts, np.broadcast_to(position, starts.shape))
        share[matters] = np.where(blocked, np.float32(SHADOW), np.float32(1))
        soft = cv2.blur(share, (3, 3))
        return np.asarray(cv2.resize(soft, weight.shape[::-1]), np.float32)


def _seen_from(position: F32, grid: GridSpec, occluded: Occluded) -> F32:
    """Share (nx, ny) float32 in [0, 1] of the probes above each cell that see the light."""
    nx, ny = grid.shape
    cells = np.stack(np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"), axis=-1)
    centres: F64 = grid.centres(cells.reshape(-1, 2))
    seen = np.zeros(nx * ny, np.float32)
    for height in PROBE_HEIGHTS_M:
        probes = np.column_stack([centres, np.full(len(centres), height)]).astype(np.float32)
        seen += ~occluded(np.broadcast_to(position, probes.shape), probes)
    share: F32 = seen.reshape(nx, ny) / np.float32(len(PROBE_HEIGHTS_M))
    return share


def _blurred(seen: list[F32], shape: tuple[int, int]) -> F32:
    """Visibility (L, nx, ny) with soft edges, averaged over lit cells only.

    The inside of a wall, where no light is seen, must not darken the rooms beside it.
    """
    lit = np.zeros(shape, np.float32)
    for one in seen:
        lit[one > 0] = 1
    window = (BLUR_CELLS, BLUR_CELLS)
    share = np.maximum(cv2.blur(lit, window), 1e-6)
    blurred = [cv2.blur(one, window) / share for one in seen]
    return np.array(blurred, np.float32).reshape(-1, *shape)
