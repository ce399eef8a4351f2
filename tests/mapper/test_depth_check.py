"""Diagnosis of depth: the floor's height, near depth, and silence."""

from __future__ import annotations

import math

import numpy as np
import pytest

from onemap_mapper.depth_check import check_depth, floor_height
from onemap_shared.geometry import F64
from tests.mapper import scenes

TABLE = scenes.Box((0.8, -1.0, 0.5), (2.0, 1.0, 0.55))


def seen_as(T_believed: F64, boxes: tuple[scenes.Box, ...] = scenes.ROOM) -> float:
    """The floor's height if the camera is believed to be elsewhere than it is."""
    depth = scenes.depth_of(boxes, scenes.pose())
    return check_depth(depth, intrinsics=scenes.CAMERA, T_map_camera=T_believed).floor_height_m


@pytest.mark.parametrize("error_m", [-0.4, -0.1, 0.0, 0.07, 0.5])
def test_a_wrong_mounting_moves_the_floor(error_m: float) -> None:
    assert seen_as(scenes.pose(height_m=1.0 + error_m)) == pytest.approx(error_m, abs=0.01)


def test_the_floor_is_found_below_a_table() -> None:
    assert seen_as(scenes.pose(), (*scenes.ROOM, TABLE)) == pytest.approx(0, abs=0.01)


def test_without_depth_there_is_no_floor() -> None:
    check = check_depth(
        np.zeros((60, 80), np.float32), intrinsics=scenes.CAMERA, T_map_camera=scenes.pose()
    )
    assert (check.valid_fraction, check.near_fraction) == (0, 0)
    assert math.isnan(check.floor_height_m)


def test_walls_are_no_floor() -> None:
    z = np.random.default_rng(0).uniform(-1, 1, 1000)
    assert math.isnan(floor_height(z[:40]))


def test_depth_in_the_wrong_unit_is_near() -> None:
    depth = np.full((480, 640), 0.003, np.float32)
    depth[:240] = 0
    check = check_depth(depth, intrinsics=scenes.CAMERA, T_map_camera=scenes.pose())
    assert check.near_fraction == 1
    assert check.valid_fraction == 0.5
