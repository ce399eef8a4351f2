"""Projection through scattered weights against the upsampled image."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.frame.cloud import DeviceCloud
from onemap_mapper.frame.projection import (
    MAX_ENTRIES,
    MAX_FRAME_CELLS,
    CellWeights,
    cell_features,
    project,
)
from onemap_mapper.params import MapParams
from onemap_shared.camera import Intrinsics, unproject
from onemap_shared.geometry import F32, F64, Bool, transform
from onemap_shared.grid import GridTooLarge
from tests.mapper import scenes
from tests.reference import mapping as slow

EVERYTHING = MapParams(max_feature_range_m=100.0, max_feature_height_m=100.0)
SMALL = Intrinsics(9.0, 8.0, 6.5, 5.0)


def projected(
    depth_m: F32, variance: F32, T: F64, shape: tuple[int, int], limits: MapParams
) -> CellWeights:
    cloud = DeviceCloud.of(torch.from_numpy(depth_m), intrinsics=SMALL, T_map_camera=T)
    return project(cloud, torch.from_numpy(variance), patch_shape=shape, params=limits)


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
    fast = cell_features(weights, torch.from_numpy(features.reshape(h * w, 3))).numpy()
    cells = slow.projected(
        features, depth, variance, intrinsics=SMALL, T_map_camera=T, cell_size_m=0.1
    )
    assert {tuple(cell) for cell in weights.cells.tolist()} == set(cells)
    expected, confidence = slow.table(cells, weights.cells.numpy())
    np.testing.assert_allclose(fast, expected, atol=2e-5)
    np.testing.assert_allclose(weights.confidence, confidence, rtol=1e-5)


def test_range_and_height_limit_the_pixels() -> None:
    T = scenes.pose()
    depth = np.full((11, 13), 2.0, np.float32)
    variance = np.ones(depth.shape, np.float32)
    everything = projected(depth, variance, T, (2, 2), EVERYTHING)
    near = projected(
        depth,
        variance,
        T,
        (2, 2),
        MapParams(max_feature_range_m=1.9, max_feature_height_m=100.0),
    )
    low = projected(
        depth,
        variance,
        T,
        (2, 2),
        MapParams(max_feature_range_m=100.0, max_feature_height_m=0.3),
    )
    assert len(near.cells) == 0
    assert 0 < len(low.cells) < len(everything.cells)


@pytest.mark.parametrize(
    ("side", "patch_shape"), [(12, (2, MAX_ENTRIES)), (2 * int(MAX_FRAME_CELLS**0.5), (1, 1))]
)
def test_a_frame_of_too_many_cells_or_patches_is_refused(
    side: int, patch_shape: tuple[int, int]
) -> None:
    camera = Intrinsics(side / 200, side / 200, side / 2, side / 2)  # a cell or more for each pixel
    ones = torch.ones((side, side))
    cloud = DeviceCloud.of(ones, intrinsics=camera, T_map_camera=np.eye(4))
    with pytest.raises(GridTooLarge, match="are the intrinsics right"):
        project(
            cloud,
            ones,
            patch_shape=patch_shape,
            params=EVERYTHING,
        )
