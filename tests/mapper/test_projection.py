"""Projection against the upsampled image; the cloud of points."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.frame.projection import CellWeights, project
from onemap_mapper.params import MapParams
from onemap_shared.camera import Intrinsics, unproject_to_map
from onemap_shared.geometry import F32, F64, Bool, transform
from tests.mapper import scenes
from tests.reference import mapping as slow
from tests.reference.mapping import unproject

EVERYTHING = MapParams(max_feature_range_m=100.0, max_feature_height_m=100.0)
SMALL = Intrinsics(9.0, 8.0, 6.5, 5.0)


def projected(
    depth_m: F32, variance: F32, T: F64, shape: tuple[int, int], limits: MapParams
) -> CellWeights:
    return project(
        depth_m, variance, intrinsics=SMALL, T_map_camera=T, patch_shape=shape, params=limits
    )


def on_a_border(depth_m: F32, T: F64) -> Bool:
    """Pixels (H, W) whose cell float32 and float64 may disagree about."""
    cells = transform(T, unproject(depth_m, SMALL).astype(np.float64))[..., :2] / 0.1
    near = np.abs(cells - np.round(cells)) < 1e-4
    return np.asarray(near.any(axis=-1))


@given(seed=st.integers(0, 2**16), h=st.integers(1, 4), w=st.integers(1, 5))
@settings(max_examples=25, deadline=None)
def test_agrees_with_the_upsampled_image(seed: int, h: int, w: int) -> None:
    rng = np.random.default_rng(seed)
    T = scenes.pose(rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(-3, 3))
    depth = rng.uniform(0.3, 2.0, (11, 13)).astype(np.float32)
    depth[(rng.random(depth.shape) < 0.1) | on_a_border(depth, T)] = 0
    variance = rng.uniform(0.5, 4.0, depth.shape).astype(np.float32)
    variance[rng.random(depth.shape) < 0.1] = np.inf
    features = rng.normal(size=(h, w, 3)).astype(np.float32)
    weights = projected(depth, variance, T, (h, w), EVERYTHING)
    fast = weights.rows.times(torch.from_numpy(features.reshape(h * w, 3))).numpy()
    cells = slow.projected(
        features, depth, variance, intrinsics=SMALL, T_map_camera=T, cell_size_m=0.1
    )
    assert {tuple(cell) for cell in weights.cells.tolist()} == set(cells)
    expected, confidence = slow.table(cells, weights.cells)
    np.testing.assert_allclose(fast, expected, atol=2e-5)
    np.testing.assert_allclose(weights.confidence, confidence, rtol=1e-5)


def test_range_and_height_limit_the_pixels() -> None:
    T = scenes.pose()
    depth = np.full((11, 13), 2.0, np.float32)
    variance = np.ones(depth.shape, np.float32)
    everything = projected(depth, variance, T, (2, 2), EVERYTHING)
    near, low = (
        projected(depth, variance, T, (2, 2), scenes.params(**limits))
        for limits in (
            {"max_feature_range_m": 1.9, "max_feature_height_m": 100.0},
            {"max_feature_range_m": 100.0, "max_feature_height_m": 0.3},
        )
    )
    assert len(near.cells) == 0
    assert 0 < len(low.cells) < len(everything.cells)


def test_more_entries_than_were_reserved() -> None:
    """Every pixel in a cell of its own."""
    side = 120
    camera = Intrinsics(10.0, 10.0, side / 2, side / 2)
    depth, variance = np.full((2, side, side), 2.0, np.float32)
    weights = project(
        depth,
        variance,
        intrinsics=camera,
        T_map_camera=np.eye(4),
        patch_shape=(2, 2),
        params=MapParams(max_feature_height_m=100.0),
    )
    assert len(weights.cells) == side * side
    np.testing.assert_allclose(weights.confidence, 0.5, rtol=1e-6)


T = scenes.pose(1.0, -2.0, 0.7)
DEPTH_M = np.random.default_rng(0).uniform(0.2, 5, (11, 13)).astype(np.float32)


@pytest.mark.parametrize("stride", [1, 2, 3])
def test_a_cloud_of_some_pixels_has_their_points(stride: int) -> None:
    depth_m = DEPTH_M * (DEPTH_M > 1)  # with pixels without return
    cloud = PointCloud.of(depth_m, intrinsics=SMALL, T_map_camera=T, stride=stride)
    expected = unproject_to_map(depth_m, SMALL, T)[::stride, ::stride]
    np.testing.assert_array_equal(cloud.depth_m, depth_m[::stride, ::stride])
    np.testing.assert_array_equal(np.stack(cloud.planes[1:], axis=-1), expected)
