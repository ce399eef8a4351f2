"""Images of worlds of boxes with all that a depth camera does wrong."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from onemap_mapper.frame.cloud import PointCloud
from onemap_shared.geometry import F32, F64
from tests.mapper import scenes
from tests.mapper.scenes import ROOM, Box

TABLE = Box((0.9, -0.5, 0.70), (2.1, 0.5, 0.74))
STAIRS = (Box((-9, -9, -4), (1.0, 9, 0)), Box((1.6, -9, -4), (9, 9, -0.4)))  # a gap, then lower
PIT = (Box((-9, -9, -4), (1.0, 9, 0)), Box((1.6, -9, -4), (9, 9, 0)), Box((0, -9, -9), (9, 9, -3)))
WORLDS = ((*ROOM, TABLE), STAIRS, PIT, ())
IMAGES = given(
    seed=st.integers(0, 2**16),
    world=st.sampled_from(WORLDS),
    far_m=st.sampled_from([0.0, 10_000.0]),
    missing=st.sampled_from([0.0, 0.1, 0.9]),
)


def image(seed: int, world: tuple[Box, ...], far_m: float, missing: float) -> tuple[F32, F64]:
    """Depth with noise, holes and one large hole, and a pose with pitch and roll."""
    rng = np.random.default_rng(seed)
    x_m, y_m, yaw_rad = rng.uniform((-1, -1, -3), (1, 1, 3))
    T = scenes.rolled(
        scenes.pose(x_m, y_m, yaw_rad, rng.uniform(0.3, 2)), float(rng.uniform(-0.3, 0.3))
    )
    depth = scenes.depth_of(world, T)
    depth += rng.normal(0, 0.01, depth.shape).astype(np.float32) * depth**2
    depth[rng.random(depth.shape) < missing] = 0
    row, column = rng.integers(0, (50, 60))
    depth[row : row + 12, column : column + 20] = 0
    T[:2, 3] += far_m
    return np.maximum(depth, 0), T


def cloud(depth: F32, T: F64) -> PointCloud:
    return PointCloud.of(depth, intrinsics=scenes.CAMERA, T_map_camera=T)
