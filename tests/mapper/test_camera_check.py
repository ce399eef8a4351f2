"""The diagnostics of the camera: level surfaces, the floor over several views, what is reported."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest

from onemap_mapper.frame.camera_check import (
    CameraPose2D,
    DepthDiagnostics,
    FloorMonitor,
    LevelSurface,
    diagnosis_due,
    lowest_level_surface,
)
from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.robots import SILENT_AFTER_S, MapperTelemetry
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64
from onemap_shared.transport import Counters
from tests.mapper import scenes
from tests.reference.mapping import unproject

SIZE = (240, 320)
CAMERA = Intrinsics.from_fov(SIZE[1], SIZE[0], np.radians(79.0))


def depth_of(*boxes: scenes.Box, T_map_camera: F64 | None = None) -> F32:
    T = scenes.pose() if T_map_camera is None else T_map_camera
    return scenes.depth_of((*scenes.ROOM, *boxes), T, CAMERA, SIZE)


def surface_in(depth_m: F32, T_believed: F64 | None = None) -> LevelSurface | None:
    T = scenes.pose() if T_believed is None else T_believed
    cloud = PointCloud.of(depth_m, intrinsics=CAMERA, T_map_camera=T)
    return lowest_level_surface(cloud)


def height_in(depth_m: F32, T_believed: F64 | None = None) -> float:
    surface = surface_in(depth_m, T_believed)
    assert surface is not None
    return surface.height_m


@pytest.mark.parametrize("error_m", [-1.2, -0.4, -0.1, 0.0, 0.07, 0.5])
def test_a_wrong_height_of_the_camera_moves_the_floor_as_far(error_m: float) -> None:
    believed = scenes.pose(height_m=1.0 + error_m)
    assert height_in(depth_of(), believed) == pytest.approx(error_m, abs=0.01)


@pytest.mark.parametrize("axis", [0, 2], ids=["pitch", "roll"])
@pytest.mark.parametrize("error_deg", [-5.0, 3.0])
def test_a_wrong_angle_of_the_camera_tilts_the_floor_by_it(axis: int, error_deg: float) -> None:
    c, s = np.cos(np.radians(error_deg)), np.sin(np.radians(error_deg))
    one, other = ((axis + 1) % 3, (axis + 2) % 3)
    turn = np.eye(4)
    turn[one, one], turn[one, other], turn[other, one], turn[other, other] = c, -s, s, c
    surface = surface_in(depth_of(), scenes.pose() @ turn)
    assert surface is not None
    assert np.degrees(surface.tilt_rad) == pytest.approx(abs(error_deg), rel=0.07)


def ramp() -> F32:
    """A plane through the camera's foot that rises by 30 degrees straight ahead."""
    rays = unproject(np.ones(SIZE, np.float32), CAMERA) @ scenes.pose()[:3, :3].T
    up = np.array([-np.sin(np.radians(30.0)), 0.0, np.cos(np.radians(30.0))])
    towards = -rays @ up
    return np.where(towards > 0.05, up[2] / np.maximum(towards, 0.05), 0.0).astype(np.float32)


@pytest.mark.parametrize(
    "depth_m",
    [
        pytest.param(np.zeros(SIZE, np.float32), id="nothing"),
        pytest.param(np.full(SIZE, 2.0, np.float32), id="2 m everywhere"),
        pytest.param(ramp(), id="a ramp"),
        pytest.param(
            np.random.default_rng(0).uniform(0.5, 3.0, SIZE).astype(np.float32), id="noise"
        ),
    ],
)
def test_what_is_not_level_is_no_floor(depth_m: F32) -> None:
    assert surface_in(depth_m) is None


@pytest.mark.parametrize("size", [(1, 1), (5, 7), (8, 900), (900, 8)])
@pytest.mark.parametrize("focal_px", [1e-3, 1e12, 1e30])
def test_impossible_images_and_cameras_are_no_crash(size: tuple[int, int], focal_px: float) -> None:
    camera = Intrinsics(focal_px, focal_px, size[1] / 2, size[0] / 2)
    depth_m = np.full(size, 2.0, np.float32)
    cloud = PointCloud.of(depth_m, intrinsics=camera, T_map_camera=scenes.pose())
    surface = lowest_level_surface(cloud)
    assert surface is None or np.isfinite([surface.height_m, surface.tilt_rad]).all()


FLOOR = LevelSurface(0.01, radians(0.5))
TABLE_TOP = LevelSurface(0.45, radians(0.5))


def turning(surface: LevelSurface, degrees: int, *, at_s: float = 0.0) -> FloorMonitor:
    """Turned on the spot, with a reading at every degree."""
    monitor = FloorMonitor()
    for degree in range(degrees + 1):
        here = CameraPose2D(0.0, 0.0, radians(degree))
        monitor = monitor.with_surface(surface, here, at_s + 0.01 * degree)
    return monitor


def test_one_view_of_the_floor_outweighs_all_tables() -> None:
    monitor = turning(TABLE_TOP, 180).with_surface(FLOOR, CameraPose2D(0.0, 0.0, radians(-90)), 4.0)
    floor = monitor.assessment(5.0)
    assert floor is not None
    assert not floor.wrong


def test_a_tilt_is_reported_though_the_height_depends_on_the_distance() -> None:
    monitor = FloorMonitor()
    for k in range(6):
        tilted = LevelSurface(-0.05 * k, radians(5.0))
        monitor = monitor.with_surface(tilted, CameraPose2D(0.0, 0.0, radians(60 * k)), float(k))
    assessment = monitor.assessment(6.0)
    assert assessment is not None
    assert "5.0 degrees" in assessment.problem


AHEAD = CameraPose2D(0.0, 0.0, 0.0)
GOOD = DepthDiagnostics(0.9, 0.0, AHEAD, LevelSurface(0.01, 0.0))


def fed(*depths: DepthDiagnostics | None, every_s: float = 0.2) -> MapperTelemetry:
    telemetry = MapperTelemetry()
    for k, depth in enumerate(depths):
        now_s = k * every_s
        telemetry.record_fused(now_s=now_s, update_ms=7.0, stamp_ns=int(now_s * 1e9), depth=depth)
    return telemetry


@pytest.mark.parametrize(
    ("depth", "sentence"),
    [
        (DepthDiagnostics(0.0, 0.0, AHEAD), "all zero"),
        (DepthDiagnostics(0.9, 0.8, AHEAD), "nearer than 0.1 m"),
    ],
)
def test_bad_depth_is_reported_but_frames_are_fused(depth: DepthDiagnostics, sentence: str) -> None:
    telemetry = fed(depth)
    assert sentence in telemetry.problem(0.5)
    assert telemetry.ready(0.5)


def reported(height_m: float) -> list[DepthDiagnostics]:
    """Frames of a robot that turns by 180 degrees and sees the floor at this height."""
    headings = [radians(45 * k) for k in range(5)]
    surface = LevelSurface(height_m, 0.0)
    return [DepthDiagnostics(0.9, 0.0, CameraPose2D(0.0, 0.0, h), surface) for h in headings]


def test_a_wrong_floor_is_reported_as_sentence_and_metrics() -> None:
    telemetry = fed(*reported(-0.3))
    assert "z = -0.30 m" in telemetry.problem(2.0)
    assert telemetry.ready(2.0)
    metrics = telemetry.metrics(2.0, Counters())
    assert metrics["floor_height_m"] == pytest.approx(-0.3)
    assert (metrics["floor_wrong"], metrics["floor_viewpoints"]) == (1, 5)


def test_silence_and_rejected_frames_are_reported() -> None:
    telemetry = MapperTelemetry()
    assert "waiting for the first frame" in telemetry.problem(0.0)
    assert not telemetry.ready(0.0)
    telemetry = fed(GOOD)
    assert "no frame from perception for" in telemetry.problem(SILENT_AFTER_S + 1)
    assert not telemetry.ready(SILENT_AFTER_S + 1)
    telemetry.record_rejected("another encoder")
    assert telemetry.problem(0.1) == "another encoder"
    assert not telemetry.ready(0.1)
    telemetry.record_fused(now_s=0.2, update_ms=1.0, stamp_ns=1, depth=GOOD)
    assert telemetry.ready(0.3)


def test_a_frame_a_second_is_diagnosed_whatever_the_clock_does() -> None:
    diagnosed: list[int] = []
    for stamp_ms in (0, 200, 900, 1000, 1900, 2000, 100, 900, 1100):
        if diagnosis_due(stamp_ms * 10**6, diagnosed[-1] * 10**6 if diagnosed else None):
            diagnosed.append(stamp_ms)
    assert diagnosed == [0, 1000, 2000, 100, 1100]
    telemetry = fed(DepthDiagnostics(0.0, 0.0, AHEAD), None, None)
    assert "all zero" in telemetry.problem(0.5)
    assert telemetry.diagnosed_ns == 0
    telemetry.reset_floor()
    assert diagnosis_due(1, telemetry.diagnosed_ns)
