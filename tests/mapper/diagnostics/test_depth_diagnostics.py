"""Diagnosis of depth: what is seen of the floor, near depth, and no depth."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.frame.camera_check import CameraPose2D, DepthDiagnostics, diagnose_depth
from onemap_mapper.frame.cloud import PointCloud
from onemap_shared.geometry import F32, F64
from tests.mapper import scenes


def diagnosed(depth_m: F32, T_map_camera: F64) -> DepthDiagnostics:
    cloud = PointCloud.of(depth_m, intrinsics=scenes.CAMERA, T_map_camera=T_map_camera)
    return diagnose_depth(cloud)


def test_the_floor_is_reported_with_the_pose_it_was_seen_from() -> None:
    T = scenes.pose(1.0, 0.5, 0.3)
    diagnostics = diagnosed(scenes.depth_of(scenes.ROOM, T), T)
    assert diagnostics.surface is not None
    assert diagnostics.surface.height_m == pytest.approx(0.0, abs=0.01)
    offset = diagnostics.viewpoint.offset_to(CameraPose2D(1.0, 0.5, 0.3))
    assert offset == pytest.approx((0.0, 0.0), abs=1e-6)
    assert diagnostics.problem == ""


def test_without_depth_there_is_no_floor() -> None:
    diagnostics = diagnosed(np.zeros((60, 80), np.float32), scenes.pose())
    assert (diagnostics.valid_fraction, diagnostics.near_fraction) == (0, 0)
    assert diagnostics.surface is None
    assert "all zero" in diagnostics.problem


def test_depth_in_the_wrong_unit_is_near() -> None:
    depth = np.full((480, 640), 0.003, np.float32)
    depth[:240] = 0
    diagnostics = diagnosed(depth, scenes.pose())
    assert diagnostics.near_fraction == 1
    assert diagnostics.valid_fraction == 0.5
    assert "100% of the depth is nearer than 0.1 m" in diagnostics.problem
