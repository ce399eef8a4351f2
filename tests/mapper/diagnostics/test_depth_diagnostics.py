"""Diagnosis of depth: what is seen of the floor, near depth, and silence."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.diagnostics.depth_diagnostics import diagnose_depth
from onemap_mapper.diagnostics.floor_monitor import CameraPose2D
from tests.mapper import scenes


def test_the_floor_is_told_with_the_place_it_was_seen_from() -> None:
    T = scenes.pose(1.0, 0.5, 0.3)
    depth = scenes.depth_of(scenes.ROOM, T)
    check = diagnose_depth(depth, intrinsics=scenes.CAMERA, T_map_camera=T)
    assert check.surface is not None
    assert check.surface.height_m == pytest.approx(0.0, abs=0.01)
    assert check.viewpoint.offset_to(CameraPose2D(1.0, 0.5, 0.3)) == pytest.approx(
        (0.0, 0.0), abs=1e-6
    )


def test_without_depth_there_is_no_floor() -> None:
    check = diagnose_depth(
        np.zeros((60, 80), np.float32), intrinsics=scenes.CAMERA, T_map_camera=scenes.pose()
    )
    assert (check.valid_fraction, check.near_fraction) == (0, 0)
    assert check.surface is None


def test_depth_in_the_wrong_unit_is_near() -> None:
    depth = np.full((480, 640), 0.003, np.float32)
    depth[:240] = 0
    check = diagnose_depth(depth, intrinsics=scenes.CAMERA, T_map_camera=scenes.pose())
    assert check.near_fraction == 1
    assert check.valid_fraction == 0.5
