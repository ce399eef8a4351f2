"""The cloud: points on their rays, and views of it that keep them there."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.frame import cloud as cloud_module
from onemap_mapper.frame.cloud import PointCloud
from onemap_shared.camera import Intrinsics
from tests.mapper import scenes

CAMERA = Intrinsics(9.0, 8.0, 6.5, 5.0)
T = scenes.pose(1.0, -2.0, 0.7)
DEPTH_M = np.random.default_rng(0).uniform(0.2, 5, (11, 13)).astype(np.float32)


def test_a_pixel_without_depth_lies_at_the_camera() -> None:
    cloud = PointCloud.of(np.zeros((2, 3), np.float32), intrinsics=CAMERA, T_map_camera=T)
    np.testing.assert_allclose(cloud.points_m, np.broadcast_to(T[:3, 3], (2, 3, 3)), rtol=1e-6)


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("stride", [1, 2, 3])
def test_a_cloud_made_of_some_pixels_is_the_strided_cloud(
    stride: int, compiled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cloud_module, "AVAILABLE", compiled)
    depth_m = DEPTH_M * (DEPTH_M > 1)  # with pixels without return
    thin = PointCloud.of(depth_m, intrinsics=CAMERA, T_map_camera=T, stride=stride)
    whole = PointCloud.of(depth_m, intrinsics=CAMERA, T_map_camera=T).strided(stride)
    np.testing.assert_array_equal(thin.depth_m, whole.depth_m)
    np.testing.assert_array_equal(thin.points_m, whole.points_m)
