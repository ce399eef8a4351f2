"""Poses measure bearings and distances to points of the map."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_planner.motion.motions import Pose2d, moved
from onemap_shared.geometry import Velocity2d

metres = st.floats(-50, 50)


@given(metres, metres, st.floats(-9, 9), st.floats(0.1, 20), st.floats(-3.1, 3.1))
def test_bearing_and_distance_lead_to_the_point(
    x: float, y: float, yaw: float, distance: float, bearing: float
) -> None:
    pose = Pose2d(x, y, yaw)
    angle = yaw + bearing
    point = (x + distance * math.cos(angle), y + distance * math.sin(angle))
    assert pose.distance_to(point) == pytest.approx(distance)
    assert pose.bearing_to(point) == pytest.approx(bearing, abs=1e-6)


def test_left_is_positive() -> None:
    assert Pose2d(0.0, 0.0, 0.0).bearing_to((0.0, 1.0)) == pytest.approx(math.pi / 2)


@given(metres, metres, st.floats(-3, 3), st.floats(-1, 1), st.floats(-1, 1))
def test_moving_ahead_and_to_the_left(
    x: float, y: float, yaw: float, linear: float, lateral: float
) -> None:
    pose = moved(Pose2d(x, y, yaw), Velocity2d(linear, 0.0, lateral), 2.0)
    left = yaw + math.pi / 2
    ahead_m, left_m = 2 * linear, 2 * lateral
    assert pose.x_m == pytest.approx(x + ahead_m * math.cos(yaw) + left_m * math.cos(left))
    assert pose.y_m == pytest.approx(y + ahead_m * math.sin(yaw) + left_m * math.sin(left))
    assert pose.yaw_rad == pytest.approx(yaw)
