"""Visibility of objects from camera positions, by rays to sampled surface points."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F32, F64, Bool
from onemap_simulator.rendering.ray_tracer import SHADOW_MARGIN, RayTracer
from onemap_simulator.scene.scene import Scene

SAMPLES = 48  # surface points per object: 0.1 m apart on a chair
# Fractional parts of the multiples of these fill the unit cube evenly (Roberts, R3 sequence).
_EVEN: F64 = 1.2207440846057596 ** -np.arange(1.0, 4.0)


def visible_from(tracer: RayTracer, scene: Scene, index: int, eyes: F32) -> Bool:
    """Whether (N,) object ``index`` is visible from eyes (N, 3) float32 in metres.

    It is if the ray to any of its sampled surface points hits no other object first. A part of
    the object that occludes the point counts as the object.
    """
    seen = np.zeros(len(eyes), bool)
    triangles = scene.vertices[scene.faces[scene.face_object == index]].astype(np.float64)
    for point in surface_points(triangles, SAMPLES).astype(np.float32):
        waiting = np.flatnonzero(~seen)
        if not len(waiting):
            break
        hits = tracer.first_hits(eyes[waiting], point - eyes[waiting])
        free = (hits.face < 0) | (hits.distance >= 1.0 - SHADOW_MARGIN)
        seen[waiting] = free | (scene.face_object[hits.face] == index)
    return seen


def surface_points(triangles: F64, count: int) -> F64:
    """Points (count, 3) spread evenly by area over triangles (N, 3, 3), deterministic.

    Any first few of them cover the surface coarsely. Triangles without any area give their
    corners.
    """
    edges = triangles[:, 1:] - triangles[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).cumsum()
    if area[-1] <= 0:
        return triangles.reshape(-1, 3)[:count]
    even = (0.5 + np.arange(1, count + 1)[:, None] * _EVEN) % 1.0
    chosen = np.minimum(np.searchsorted(area, even[:, 0] * area[-1], "right"), len(area) - 1)
    u, v = even[:, 1], even[:, 2]
    beyond = u + v > 1  # the other half of the parallelogram, folded back
    weights = np.where(beyond, 1.0 - np.stack([u, v]), np.stack([u, v]))
    points: F64 = triangles[chosen, 0] + np.einsum("kn,nkd->nd", weights, edges[chosen])
    return points
