"""The assessment of the floor in furnished apartments, from poses close to furniture."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
import pytest

from onemap_mapper.frame.camera_check import FloorMonitor, FloorState, diagnose_depth
from onemap_mapper.frame.cloud import PointCloud
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, camera_mount, pose_2d
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import measured_mm, noisy_depth
from onemap_simulator.scene.spawn import free_space

SEEDS = (3, 4)
POSES = 20
CLOSE_M = 0.45  # from the camera to the nearest thing
CAMERA = Intrinsics.from_fov(320, 240, np.radians(79.0))
MOUNT = camera_mount(0.1, 1.0, np.radians(12.0))


def rolled(mount: F64, angle_deg: float) -> F64:
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    turn = np.eye(4)
    turn[:2, :2] = [[c, -s], [s, c]]
    return mount @ turn


WRONG = {
    "0.2 m too high": camera_mount(0.1, 1.2, np.radians(12.0)),
    "0.2 m too low": camera_mount(0.1, 0.8, np.radians(12.0)),
    "5 degrees down": camera_mount(0.1, 1.0, np.radians(17.0)),
    "5 degrees up": camera_mount(0.1, 1.0, np.radians(7.0)),
    "5 degrees of roll": rolled(MOUNT, 5.0),
}


@cache
def views(seed: int) -> list[tuple[F64, F32]]:
    """T_map_body and exact depth (240, 320) metres: half face what is nearest, half anything."""
    scene = generate_apartment(seed)
    renderer = Renderer(scene)
    grid, clearance = free_space(scene)
    close = np.argwhere((clearance > 0) & (clearance < CLOSE_M))
    blocked = np.argwhere(clearance == 0)
    rng = np.random.default_rng(seed)
    found = []
    for k in range(POSES):
        cell = close[rng.integers(len(close))]
        towards = blocked[np.linalg.norm(blocked - cell, axis=1).argmin()] - cell
        yaw = np.arctan2(towards[1], towards[0]) if k % 2 == 0 else rng.uniform(-np.pi, np.pi)
        x_m, y_m = (float(value) for value in grid.centres(cell))
        T_map_body = pose_2d(x_m, y_m, float(yaw))
        view = renderer.render(T_map_body @ MOUNT, CAMERA, width=320, height=240)
        found.append((T_map_body, view.depth_m))
    return found


def assessments(seed: int, believed: F64, noise_m: float) -> Iterator[FloorState]:
    """The state after each frame, one a second, of a camera believed to be mounted like this."""
    rng, monitor = np.random.default_rng(seed), FloorMonitor()
    for at_s, (T_map_body, exact_m) in enumerate(views(seed)):
        depth_m = noisy_depth(exact_m, noise_m, rng)
        measured = np.divide(measured_mm(depth_m, 0.1, 8.0), 1000, dtype=np.float32)
        check = diagnose_depth(
            PointCloud.of(measured, intrinsics=CAMERA, T_map_camera=T_map_body @ believed)
        )
        if check.surface is not None:
            monitor = monitor.with_surface(check.surface, check.viewpoint, at_s)
        yield monitor.assessment(at_s).state


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("noise_m", [0.0, 0.01])
def test_a_camera_that_is_mounted_right_raises_no_alarm(seed: int, noise_m: float) -> None:
    states = list(assessments(seed, MOUNT, noise_m))
    assert FloorState.INCONSISTENT not in states
    assert states[-1] is FloorState.CONSISTENT


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("error", WRONG)
@pytest.mark.parametrize("noise_m", [0.0, 0.01])
def test_a_camera_that_is_mounted_wrong_is_reported(seed: int, error: str, noise_m: float) -> None:
    assert FloorState.INCONSISTENT in assessments(seed, WRONG[error], noise_m)
