"""The simulated room is seen right, and the benchmark reports its times and memory."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_shared.camera import unproject_to_map
from onemap_shared.geometry import camera_mount, pose_2d
from onemap_tools.bench.fusion import (
    CAMERA,
    ROOM_HIGH,
    ROOM_LOW,
    FusionBenchOptions,
    room_depth,
    run,
)


@pytest.mark.parametrize("yaw_rad", [0.0, 1.0, 2.5])
def test_every_pixel_sees_the_surface_of_the_room(yaw_rad: float) -> None:
    T_map_camera = pose_2d(1.0, -0.5, yaw_rad) @ camera_mount(0.0, 1.0, np.deg2rad(15))
    points = unproject_to_map(room_depth(T_map_camera), CAMERA, T_map_camera)
    to_faces = np.minimum(np.abs(points - ROOM_LOW), np.abs(points - ROOM_HIGH))
    assert to_faces.min(axis=-1).max() < 1e-4
    inside = (points > np.subtract(ROOM_LOW, 1e-4)) & (points < np.add(ROOM_HIGH, 1e-4))
    assert inside.all()


def test_times_and_memory_are_measured() -> None:
    result = run(FusionBenchOptions(frames=2))
    assert (result["frames"], result["image"], result["features"]) == (2, "640x480", "24x24x768")
    assert 0 < result["min_ms"] <= result["p50_ms"] <= result["p95_ms"]
    assert result["cells"] > 1000
    assert 0 < result["map_bytes"] < result["peak_process_bytes"]
    assert {"projection", "mix", "blur", "occupancy", "absorb"} <= result["parts_ms"].keys()
    assert all(part_ms > 0 for part_ms in result["parts_ms"].values())
    assert result["moved_bytes"] > 640 * 480 * 6 + 24 * 24 * 768 * 2
    assert min(result["copy_gb_s"], result["matrix_gflops"], result["cpu_min_over_least"]) > 0
