"""Success places by their definition, one ray and one triangle at a time."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64, Bool
from onemap_simulator.ground_truth import SUCCESS_RADIUS_M
from onemap_simulator.ground_truth.truth import horizontal_distances
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.scene.scene import Scene
from tests.reference.occupancy_raster import surface_points

RADIUS_M, HEIGHT_M, EYE_HEIGHT_M = 0.2, 1.1, 1.0
SPACING_M = 0.25


def literal_success(scene: Scene, category: str, places: F64) -> Bool:
    """Which of the places (N, 2) in metres count as success for the category."""
    free = CollisionMap.of(scene, HEIGHT_M, 0.05)
    triangles = scene.vertices[scene.faces].astype(np.float64)
    found = np.zeros(len(places), bool)
    for index, thing in enumerate(scene.objects):
        if thing.category != category:
            continue
        mine = scene.face_object == index
        points = np.concatenate(
            [surface_points(triangle, SPACING_M) for triangle in triangles[mine]]
        )
        for row, place in enumerate(places):
            near = horizontal_distances(triangles[mine], place).min() <= SUCCESS_RADIUS_M
            if near and free.clearance_m(*place) >= RADIUS_M:
                eye = np.array([*place, EYE_HEIGHT_M])
                found[row] |= any(not blocked(eye, point, triangles[~mine]) for point in points)
    return found


def blocked(eye: F64, point: F64, triangles: F64) -> bool:
    """Whether any of the triangles (N, 3, 3) crosses the segment (Moeller and Trumbore)."""
    edge_1, edge_2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    ray = point - eye
    normal = np.cross(ray, edge_2)
    volume = (edge_1 * normal).sum(axis=1)
    crossing = np.abs(volume) > 1e-12
    safe = np.where(crossing, volume, 1.0)
    to_eye = eye - triangles[:, 0]
    u = (to_eye * normal).sum(axis=1) / safe
    other = np.cross(to_eye, edge_1)
    v = (ray * other).sum(axis=1) / safe
    t = (edge_2 * other).sum(axis=1) / safe
    return bool((crossing & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0.01) & (t < 0.99)).any())
