from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from onemap_ros2.images import CameraPair, register_depth
from onemap_shared.camera import Intrinsics
from tests.reference.depth_registration import register_depth as obvious

DEPTH = Intrinsics(30.0, 30.0, 16.0, 12.0)
T_SIDE = np.eye(4)
T_SIDE[:3, 3] = (-0.05, 0.01, 0.0)
T_TURNED = T_SIDE.copy()
T_TURNED[:3, :3] = Rotation.from_rotvec((0.02, -0.05, 0.1)).as_matrix()


def test_the_same_camera_sees_the_same() -> None:
    depth = np.random.default_rng(0).integers(0, 5000, (24, 32)).astype(np.uint16)
    same = register_depth(depth, CameraPair(DEPTH, DEPTH, np.eye(4)), (24, 32))
    np.testing.assert_array_equal(same, depth)


@pytest.mark.parametrize("T", [T_SIDE, T_TURNED])
@pytest.mark.parametrize("color", [DEPTH, Intrinsics(64.0, 64.0, 30.0, 20.0)])
def test_it_agrees_with_the_obvious_way(T: np.ndarray, color: Intrinsics) -> None:
    rng = np.random.default_rng(1)
    depth = rng.integers(500, 4000, (24, 32)).astype(np.uint16)
    depth[rng.random(depth.shape) < 0.2] = 0
    cameras, shape = CameraPair(DEPTH, color, T), (48, 64)
    fast, slow = register_depth(depth, cameras, shape), obvious(depth, cameras, shape)
    differs = np.abs(fast.astype(int) - slow.astype(int)) > 1  # single precision: half pixels
    assert differs.mean() < 0.005
    assert (fast > 0).mean() > 0.1


def test_the_nearer_surface_hides_the_other() -> None:
    depth = np.full((24, 32), 3000, np.uint16)
    depth[:, 16:] = 1000
    moved = register_depth(depth, CameraPair(DEPTH, DEPTH, T_SIDE), (24, 32))
    row = moved[12]
    first = int(np.flatnonzero(row == 1000)[0])
    assert first < 16  # 0.05 m at 1 m are 1.5 pixels to the left
    assert set(row[first : first + 10]) == {1000}


def test_what_lies_behind_or_too_far_is_left_out() -> None:
    depth = np.full((24, 32), 60_000, np.uint16)
    T = np.eye(4)
    T[2, 3] = 10.0
    assert not register_depth(depth, CameraPair(DEPTH, DEPTH, T), (24, 32)).any()
    T[2, 3] = -70.0
    assert not register_depth(depth, CameraPair(DEPTH, DEPTH, T), (24, 32)).any()
