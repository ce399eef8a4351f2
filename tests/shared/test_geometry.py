from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_shared.geometry import (
    camera_mount,
    check_rigid,
    inverse,
    pose_2d,
    transform,
    wrap_angle,
    yaw_of,
)

angles = st.floats(-20, 20)
coordinates = st.floats(-100, 100)


@given(coordinates, coordinates, angles)
def test_inverse_undoes_a_pose(x: float, y: float, yaw: float) -> None:
    T_map_body = pose_2d(x, y, yaw)
    np.testing.assert_allclose(inverse(T_map_body) @ T_map_body, np.eye(4), atol=1e-9)


@given(coordinates, coordinates, angles)
def test_yaw_survives_a_pose(x: float, y: float, yaw: float) -> None:
    difference = wrap_angle(yaw_of(pose_2d(x, y, yaw)) - yaw)
    assert abs(difference) < 1e-9


@given(angles)
def test_wrapped_angles_are_the_same_direction(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -np.pi <= wrapped < np.pi
    assert np.cos(wrapped) == pytest.approx(np.cos(angle), abs=1e-9)
    assert np.sin(wrapped) == pytest.approx(np.sin(angle), abs=1e-9)


def test_a_level_camera_looks_along_the_body() -> None:
    T_body_camera = camera_mount(0.1, 1.0, 0.0)
    ahead_right_below = np.array([[0.5, 0.25, 2.0]])  # camera: right, down, forward
    np.testing.assert_allclose(
        transform(T_body_camera, ahead_right_below), [[2.1, -0.5, 0.75]], atol=1e-12
    )


NOT_RIGID = {
    "shape": (np.eye(3), "shape"),
    "nan": (np.full((4, 4), np.nan), "NaN"),
    "huge": (np.full((4, 4), 1e300) * [1, -1, 1, -1], "not rigid"),
    "scaled": (np.diag([2.0, 2.0, 2.0, 1.0]), "not rigid"),
    "mirror": (np.diag([1.0, 1.0, -1.0, 1.0]), "reflection"),
    "projective": (np.vstack([np.eye(4)[:3], [0, 0, 1, 1]]), "last row"),
    "far": (np.array(pose_2d(1e6, 0, 0)), "units metres"),
}


@pytest.mark.parametrize("case", NOT_RIGID)
def test_what_is_not_a_rigid_transform_is_refused(case: str) -> None:
    T, reason = NOT_RIGID[case]
    with pytest.raises(ValueError, match=reason):
        check_rigid(T, "T_map_camera")
