"""The update of one frame against projection and blur as the equations read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from onemap_mapper.frame.blur import MIN_WEIGHT
from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.frame.update import compute_update
from onemap_shared.geometry import Bool
from onemap_shared.messages import FeatureField
from tests.mapper import scenes
from tests.reference import mapping as slow

PARAMS = scenes.params()


def on_a_border(field: FeatureField) -> Bool:
    """Pixels (H, W) whose cell float32 and float64 may disagree about."""
    depth_m = np.divide(field.depth_mm, 1000, dtype=np.float32)
    cloud = PointCloud.of(depth_m, intrinsics=field.intrinsics, T_map_camera=field.T_map_camera)
    cells = cloud.points_m[..., :2].astype(np.float64) / PARAMS.cell_size_m
    return np.asarray((np.abs(cells - np.round(cells)) < 1e-4).any(axis=-1))


@pytest.mark.parametrize("compiled", [False, True])
def test_an_update_is_projection_and_blur(compiled: bool) -> None:
    field = scenes.field(3, scenes.pose(0.31, -0.17, 0.4))
    field = replace(
        field, variance=np.where(on_a_border(field), np.float32(np.inf), field.variance)
    )
    update = compute_update(field, scenes.params(max_feature_height_m=100, compiled=compiled))
    camera_xy_m = (float(field.T_map_camera[0, 3]), float(field.T_map_camera[1, 3]))
    expected = slow.blurred(
        slow.projected(
            field.features.astype(np.float32),
            np.divide(field.depth_mm, 1000, dtype=np.float32),
            field.variance,
            intrinsics=field.intrinsics,
            T_map_camera=field.T_map_camera,
            cell_size_m=PARAMS.cell_size_m,
        ),
        camera_xy_m=camera_xy_m,
        cell_size_m=PARAMS.cell_size_m,
        depth_factor=PARAMS.depth_factor,
        half_width=PARAMS.blur_half_width_cells,
    )
    features, confidence = slow.table(expected, update.cells.numpy())
    tolerance = 49 * MIN_WEIGHT * 2  # what the sparse kernel leaves out
    np.testing.assert_allclose(update.features, features, atol=tolerance)
    np.testing.assert_allclose(update.confidence, confidence, atol=tolerance)
    observed = {(int(x), int(y)) for x, y in update.cells}
    assert all(c < tolerance for cell, (_, c) in expected.items() if cell not in observed)


@pytest.mark.parametrize("max_rows", [30, 240])
def test_a_compiled_update_is_that_of_torch(max_rows: int) -> None:
    for sequence in range(4):
        field = scenes.field(sequence, scenes.pose(0.2 * sequence, -0.1, 0.9 * sequence))
        found, expected = (
            compute_update(field, scenes.params(compiled=compiled, occupancy_max_rows=max_rows))
            for compiled in (True, False)
        )
        np.testing.assert_array_equal(found.cells, expected.cells)
        torch.testing.assert_close(found.features, expected.features, rtol=0, atol=2e-6)
        torch.testing.assert_close(found.confidence, expected.confidence, rtol=1e-5, atol=1e-9)
        for name in ("cells", "evidence", "clear", "blind"):
            np.testing.assert_array_equal(
                getattr(found.occupancy, name), getattr(expected.occupancy, name)
            )
        assert found.depth.valid_fraction == expected.depth.valid_fraction
        assert found.depth.surface is not None
        assert expected.depth.surface is not None
        assert found.depth.surface.height_m == pytest.approx(expected.depth.surface.height_m)
        tilts = (found.depth.surface.tilt_rad, expected.depth.surface.tilt_rad)
        assert tilts[0] == pytest.approx(tilts[1], abs=1e-5)


def test_the_field_is_only_read() -> None:
    field = scenes.field(0, scenes.pose())
    for array in (field.features, field.variance, field.depth_mm, field.T_map_camera):
        array.flags.writeable = False
    compute_update(field, PARAMS)
