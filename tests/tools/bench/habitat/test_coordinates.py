"""Habitat's coordinates in the map and back."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_shared.geometry import check_rigid, yaw_of
from onemap_tools.bench.habitat.coordinates import (
    R_MAP_HABITAT,
    body_pose,
    habitat_rotation,
    to_habitat,
    to_map,
)

FLOOR_Y_M = 2.5


def test_up_right_and_forward_of_habitat_are_those_of_the_map() -> None:
    right, up, ahead = np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), np.array([0, 0, -1.0])
    np.testing.assert_allclose(R_MAP_HABITAT @ ahead, [1, 0, 0])
    np.testing.assert_allclose(R_MAP_HABITAT @ right, [0, -1, 0])
    np.testing.assert_allclose(R_MAP_HABITAT @ up, [0, 0, 1])
    assert np.linalg.det(R_MAP_HABITAT) == pytest.approx(1)


def test_the_floor_of_the_start_is_the_map_s_floor() -> None:
    np.testing.assert_allclose(to_map(np.array([1.0, FLOOR_Y_M, -4.0]), FLOOR_Y_M), [4, -1, 0])


def test_there_and_back() -> None:
    points = np.random.default_rng(1).normal(size=(2, 5, 3))
    before = points.copy()
    np.testing.assert_allclose(to_habitat(to_map(points, FLOOR_Y_M), FLOOR_Y_M), points)
    np.testing.assert_array_equal(points, before)


@pytest.mark.parametrize("yaw_rad", [-3.0, -1.2, 0.0, 0.4, np.pi / 2, 3.1])
def test_an_agent_heads_where_its_body_heads(yaw_rad: float) -> None:
    T_map_body = body_pose((0.5, 3.0, 2.0), habitat_rotation(yaw_rad), FLOOR_Y_M)
    check_rigid(T_map_body, "T_map_body")
    assert yaw_of(T_map_body) == pytest.approx(yaw_rad)
    np.testing.assert_allclose(T_map_body[:3, 3], [-2.0, -0.5, 0.5])
    np.testing.assert_allclose(T_map_body[:3, 2], [0, 0, 1], atol=1e-12)  # upright


def test_a_tilted_agent_looks_up_in_both() -> None:
    pitched = (float(np.sin(0.15)), 0.0, 0.0, float(np.cos(0.15)))  # 0.3 rad about Habitat's x
    forward = body_pose((0, 0, 0), pitched, 0.0)[:3, 0]
    np.testing.assert_allclose(forward, [np.cos(0.3), 0, np.sin(0.3)])
