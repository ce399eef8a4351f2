"""The map update against the output of the paper authors' released code."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from onemap_mapper.belief.cells import CellStore
from onemap_mapper.frame.blur import blur_kernel
from onemap_mapper.frame.projection import project
from onemap_mapper.params import MapParams
from onemap_perception.feature_field import VarianceParams, observation_variance
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, R_BODY_CAMERA_LEVEL

DATA = Path(__file__).parents[1] / "data" / "fusion_parity"  # described in its README.md
CELLS, TOLERANCE = 600, 1e-3
EVERYTHING = MapParams(max_feature_range_m=100.0, max_feature_height_m=100.0)

CPU = torch.device("cpu")


def camera_pose(T_map_body: F32) -> F64:
    """T_map_camera of a level camera at the body's origin."""
    T_body_camera = np.eye(4)
    T_body_camera[:3, :3] = R_BODY_CAMERA_LEVEL
    return T_map_body.astype(np.float64) @ T_body_camera


def fused(data: dict[str, np.ndarray], half_width: int, dtype: torch.dtype) -> tuple[F32, F32]:
    """Confidence (600, 600) and features (600, 600, 32) after all frames."""
    fx, fy, cx, cy = data["K"].tolist()
    # The released code counts pixel centres at whole numbers, ours lie half a pixel further.
    intrinsics = Intrinsics(fx, fy, cx + 0.5, cy + 0.5)
    slots = np.full((CELLS, CELLS), -1)
    store = CellStore(32, device=CPU, dtype=dtype, compiled=True)
    for k, (features, depth) in enumerate(zip(data["features"], data["depth"], strict=True)):
        T = camera_pose(data["pose"][k])
        variance = observation_variance(depth, intrinsics, VarianceParams())
        weights = project(
            depth,
            variance,
            intrinsics=intrinsics,
            T_map_camera=T,
            patch_shape=(8, 8),
            params=EVERYTHING,
        )
        kernel = blur_kernel(
            weights.cells,
            camera_xy_m=T[:2, 3],
            params=MapParams(depth_factor=0.01, blur_half_width_cells=half_width),
        )
        place = tuple(kernel.cells.T + CELLS // 2)
        new = slots[place] < 0
        slots[tuple(axis[new] for axis in place)] = store.new_slots(kernel.cells[new])
        patches = torch.from_numpy(features.reshape(32, 64).T.copy())
        store.fuse(
            slots[place],
            kernel.rows.times(weights.rows.times(patches)),
            kernel.confidence(weights.confidence),
            revision=k,
        )
    place = tuple(store.cells.T + CELLS // 2)
    confidence = np.zeros((CELLS, CELLS), np.float32)
    confidence[place] = store.confidence
    dense = np.zeros((CELLS, CELLS, 32), np.float32)
    dense[place] = store.features(np.arange(store.count)).numpy()
    return confidence, dense


@pytest.mark.parametrize(
    ("dtype", "tolerance"), [(torch.float32, TOLERANCE), (torch.float16, 2 * TOLERANCE)]
)
@pytest.mark.parametrize(("name", "half_width"), [("no_blur", 0), ("blur", 3)])
def test_matches_the_released_code(
    name: str, half_width: int, dtype: torch.dtype, tolerance: float
) -> None:
    with np.load(DATA / f"{name}.npz") as archive:
        data = {key: archive[key] for key in archive.files}
    place = tuple(data["cells"].T)
    released_confidence = np.zeros((CELLS, CELLS), np.float32)
    released_confidence[place] = data["confidence"]
    released_features = np.zeros((CELLS, CELLS, 32), np.float32)
    released_features[place] = data["feature_map"]
    confidence, features = fused(data, half_width, dtype)
    for ours, theirs in ((confidence, released_confidence), (features, released_features)):
        assert np.abs(ours - theirs).max() <= tolerance * np.abs(theirs).max()
