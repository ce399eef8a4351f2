"""The assessment of the floor needs several viewpoints."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_mapper.frame.camera_check import (
    READING_LIFETIME_S,
    CameraPose2D,
    FloorMonitor,
    FloorState,
    LevelSurface,
    camera_pose_2d,
)
from onemap_shared.geometry import camera_mount, pose_2d

FLOOR = LevelSurface(0.01, radians(0.5))
TABLE = LevelSurface(0.45, radians(0.5))
HERE = CameraPose2D(0.0, 0.0, 0.0)


def turning(surface: LevelSurface, degrees: int, *, at_s: float = 0.0) -> FloorMonitor:
    """Turned on the spot, with a reading at every degree."""
    monitor = FloorMonitor()
    for degree in range(degrees + 1):
        here = CameraPose2D(0.0, 0.0, radians(degree))
        monitor = monitor.with_surface(surface, here, at_s + 0.01 * degree)
    return monitor


def driving(surface: LevelSurface, metres: float) -> FloorMonitor:
    """Driven straight ahead, with a reading every 10 cm."""
    monitor = FloorMonitor()
    for x_m in np.arange(0.0, metres + 0.05, 0.1):
        monitor = monitor.with_surface(surface, CameraPose2D(float(x_m), 0.0, 0.0), float(x_m))
    return monitor


def state(monitor: FloorMonitor, now_s: float = 5.0) -> FloorState:
    return monitor.assessment(now_s).state


def test_without_readings_the_floor_is_unknown() -> None:
    assessment = FloorMonitor().assessment(0.0)
    assert (assessment.state, assessment.viewpoints, assessment.problem) == (
        FloorState.UNKNOWN,
        0,
        "",
    )


def test_one_reading_of_the_floor_is_enough() -> None:
    assessment = FloorMonitor().with_surface(FLOOR, HERE, 0.0).assessment(1.0)
    assert assessment.state is FloorState.CONSISTENT
    assert assessment.height_m == pytest.approx(0.01)


def test_a_table_seen_a_thousand_times_from_one_place_is_one_viewpoint() -> None:
    monitor = FloorMonitor()
    for k in range(1000):
        jitter = CameraPose2D(0.2 * np.sin(k), 0.2 * np.cos(k), 0.1 * np.sin(k))
        monitor = monitor.with_surface(TABLE, jitter, 0.05 * k)
    assessment = monitor.assessment(50.0)
    assert (assessment.state, assessment.viewpoints) == (FloorState.UNKNOWN, 1)


@pytest.mark.parametrize("height_m", [-1.0, -0.3, 0.3, 0.45])
def test_one_height_seen_all_around_is_a_wrong_mounting(height_m: float) -> None:
    assessment = turning(LevelSurface(height_m, 0.0), 120).assessment(5.0)
    assert assessment.state is FloorState.INCONSISTENT
    assert f"z = {height_m:+.2f} m" in assessment.problem
    assert "T_map_camera" in assessment.problem


def test_one_view_of_the_floor_outweighs_all_tables() -> None:
    monitor = turning(TABLE, 180).with_surface(FLOOR, CameraPose2D(0.0, 0.0, radians(-90)), 4.0)
    assert state(monitor) is FloorState.CONSISTENT


def test_tables_of_different_heights_do_not_agree() -> None:
    monitor = FloorMonitor()
    for k, height_m in enumerate([0.2, 0.3, 0.4, 0.5, 0.6, 0.55]):
        here = CameraPose2D(0.0, 0.0, radians(60 * k))
        monitor = monitor.with_surface(LevelSurface(height_m, 0.0), here, float(k))
    assert state(monitor, 6.0) is FloorState.UNKNOWN


def test_a_tilt_is_reported_though_the_height_depends_on_the_distance() -> None:
    monitor = FloorMonitor()
    for k in range(6):
        tilted = LevelSurface(-0.05 * k, radians(5.0))
        monitor = monitor.with_surface(tilted, CameraPose2D(0.0, 0.0, radians(60 * k)), float(k))
    assessment = monitor.assessment(6.0)
    assert assessment.state is FloorState.INCONSISTENT
    assert "5.0 degrees" in assessment.problem


def test_old_readings_expire() -> None:
    wrong = turning(TABLE, 120)
    assert state(wrong, READING_LIFETIME_S) is FloorState.INCONSISTENT
    assert state(wrong, 2 * READING_LIFETIME_S) is FloorState.UNKNOWN
    later = wrong.with_surface(FLOOR, HERE, 3 * READING_LIFETIME_S)
    assert len(later.readings) == 1


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5))
def test_the_heading_of_a_camera_does_not_depend_on_its_tilt(yaw: float, pitch: float) -> None:
    viewpoint = camera_pose_2d(pose_2d(1.0, 2.0, yaw) @ camera_mount(0.0, 1.0, pitch))
    assert viewpoint.offset_to(CameraPose2D(1.0, 2.0, yaw)) == pytest.approx((0.0, 0.0), abs=1e-6)
