"""Upright cylinders by marching along rays: slow and obvious."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F32
from onemap_simulator.physics.people import Bystanders


def marched_depth(
    origin: F32, directions: F32, place: F32, people: Bystanders, *, step_m: float
) -> F32:
    """Depth (N,) of the first point within the cylinder at ``place``; 0 if there is none to 4 m."""
    found = np.zeros(len(directions), np.float32)
    for depth in np.arange(step_m, 4.0, step_m, dtype=np.float32):
        points = origin + depth * directions
        away = np.hypot(points[:, 0] - place[0], points[:, 1] - place[1])
        inside = (away <= people.radius_m) & (points[:, 2] >= 0) & (points[:, 2] <= people.height_m)
        found = np.where((found == 0) & inside, depth, found)
    return found
