"""Light on surfaces: soft shadows of area lights, and light that other surfaces reflect.

Every pixel traces few rays, each of 4 x 4 neighbours in other directions; the neighbours on the
same surface are then averaged (interleaved sampling). Vectors are float32, colours linear RGB.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F32, Bool
from onemap_simulator.rendering.ray_tracer import RayTracer
from onemap_tools.foreign.lit_scene import AreaLight

TILE = 4  # pixels on a side that share their rays
SKY_RAYS = 4  # of each pixel, so 64 of a tile
REACH_M = 2.5  # surfaces farther away do not darken
BOUNCE = 0.62  # share of the light of the room that a near surface reflects, times its colour
LIFT_M = 0.004  # rays start this far above their surface
STRONGEST = 4  # lights of an image that are traced for every pixel
PROBES = 300  # pixels that decide which lights those are
HALF_DISTANCE_M = 1.6


@dataclass(frozen=True, slots=True)
class SurfacePoints:
    """Points (N, 3) metres with unit normals (N, 3), row by row of an image (height, width)."""

    points: F32
    normals: F32
    height: int
    width: int

    @property
    def lifted(self) -> F32:
        """Points (N, 3) where rays begin."""
        away: F32 = self.points + np.float32(LIFT_M) * self.normals
        return away

    def halved(self) -> SurfacePoints:
        """Every second row and column."""
        points, normals = (
            np.ascontiguousarray(part.reshape(self.height, self.width, 3)[::2, ::2]).reshape(-1, 3)
            for part in (self.points, self.normals)
        )
        return SurfacePoints(points, normals, -(-self.height // 2), -(-self.width // 2))


def strongest(lights: Sequence[AreaLight], at: SurfacePoints, tracer: RayTracer) -> list[AreaLight]:
    """The lights that brighten the image most, tested for some of its points with shadows."""
    step = max(len(at.points) // PROBES, 1)
    some = SurfacePoints(at.points[::step], at.normals[::step], 1, len(at.points[::step]))
    total = []
    for light in lights:
        middle = np.broadcast_to(np.array(light.position_m, np.float32), some.points.shape)
        seen = ~tracer.occluded(some.lifted, middle)
        total.append(float((falloff(light, some, middle) * seen).sum()) * sum(light.colour))
    order = np.argsort(total)[::-1][:STRONGEST]
    return [lights[index] for index in order.tolist() if total[index] > 0]


def falloff(light: AreaLight, at: SurfacePoints, source: F32) -> F32:
    """Share (N,) of a light that arrives at points, unshadowed; source (N, 3): where it shines."""
    to_light = source - at.points
    squared = np.einsum("ij,ij->i", to_light, to_light)
    length = np.sqrt(squared + 1e-6)
    cosine = np.maximum(np.einsum("ij,ij->i", to_light, at.normals) / length, 0)
    if light.facing is not None:
        cosine = cosine * np.maximum(-to_light @ np.array(light.facing, np.float32) / length, 0)
    result: F32 = (cosine / (1 + squared / HALF_DISTANCE_M**2)).astype(np.float32)
    return result


def direct(light: AreaLight, at: SurfacePoints, tracer: RayTracer, rng: np.random.Generator) -> F32:
    """Unfiltered share (N,) of a light that arrives, one random point of the light per pixel."""
    spread = pattern(rng, 3, at.height, at.width) * 2 - 1
    middle, half = np.array(light.position_m, np.float32), np.array(light.half_m, np.float32)
    source = (middle + half * spread).astype(np.float32)
    weight = falloff(light, at, source)
    lit = weight > 1e-4
    visible = np.zeros(len(weight), np.float32)
    visible[lit] = ~tracer.occluded(at.lifted[lit], source[lit])
    return weight * visible


def surroundings(
    at: SurfacePoints,
    tracer: RayTracer,
    rng: np.random.Generator,
    *,
    ambient: F32,
    face_colours: F32,
) -> F32:
    """Unfiltered light (N, 3) from the hemisphere: the room's, and what near surfaces reflect.

    face_colours (F + 1, 3): linear mean colour of every face, the last for none.
    """
    total = np.zeros_like(at.points)
    for _ in range(SKY_RAYS):
        direction = _cosine_directions(at.normals, pattern(rng, 2, at.height, at.width))
        hits = tracer.first_hits(at.lifted, direction * np.float32(REACH_M))
        open_share = np.where(hits.face >= 0, hits.distance, np.float32(1))[:, None] ** 0.5
        reflected = face_colours[hits.face] * np.float32(BOUNCE)
        total += ambient * (open_share + (1 - open_share) * reflected)
    mean: F32 = total / np.float32(SKY_RAYS)
    return mean


def averaged(values: F32, at: SurfacePoints) -> F32:
    """Mean (N, C) of a tile of neighbours that lie on the same surface; values (N, C)."""
    shape = (at.height, at.width)
    grid = values.reshape(*shape, -1)
    normals, points = at.normals.reshape(*shape, 3), at.points.reshape(*shape, 3)
    total, weights = np.zeros_like(grid), np.zeros((*shape, 1), np.float32)
    for dy in range(-1, TILE - 1):
        for dx in range(-1, TILE - 1):
            there = (
                slice(max(dy, 0), shape[0] + min(dy, 0)),
                slice(max(dx, 0), shape[1] + min(dx, 0)),
            )
            here = (
                slice(max(-dy, 0), shape[0] + min(-dy, 0)),
                slice(max(-dx, 0), shape[1] + min(-dx, 0)),
            )
            apart: F32 = np.einsum("ijk,ijk->ij", points[there] - points[here], normals[here])
            alike = np.einsum("ijk,ijk->ij", normals[there], normals[here])
            same: Bool = (np.abs(apart) < 0.03) & (alike > 0.85)
            total[here] += grid[there] * same[..., None]
            weights[here] += same[..., None]
    return np.asarray(total / np.maximum(weights, 1), np.float32).reshape(values.shape)


def pattern(rng: np.random.Generator, count: int, height: int, width: int) -> F32:
    """Numbers (height * width, count) in [0, 1): a jittered grid over each tile, shuffled."""
    cells = np.stack(np.meshgrid(np.arange(TILE), np.arange(TILE)), axis=-1).reshape(-1, 2)
    columns = []
    for index in range(count):
        column = rng.permutation(cells)[:, index % 2] if index else cells[:, 0]
        columns.append((column + rng.uniform(0, 1, len(cells))) / TILE)
    if count >= 2:
        columns[1] = (cells[:, 1] + rng.uniform(0, 1, len(cells))) / TILE
    order = rng.permutation(len(cells))
    tile = np.stack(columns, axis=-1)[order].reshape(TILE, TILE, count)
    rows, across = -(-height // TILE), -(-width // TILE)
    tiled = np.tile(tile, (rows, across, 1))[:height, :width]
    result: F32 = tiled.reshape(-1, count).astype(np.float32)
    return result


def _cosine_directions(normals: F32, numbers: F32) -> F32:
    """Unit directions (N, 3) about normals (N, 3), as dense as their cosine; numbers (N, 2)."""
    angle, radius = 2 * np.pi * numbers[:, 0], np.sqrt(numbers[:, 1])
    helper = np.where(np.abs(normals[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    side = np.cross(helper, normals)
    side /= np.maximum(np.linalg.norm(side, axis=1), 1e-6)[:, None]
    other = np.cross(normals, side)
    up = np.sqrt(np.maximum(1 - radius**2, 0))
    result: F32 = (
        (radius * np.cos(angle))[:, None] * side
        + (radius * np.sin(angle))[:, None] * other
        + up[:, None] * normals
    ).astype(np.float32)
    return result
