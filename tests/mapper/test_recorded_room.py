"""The occupancy of a real, tilted, noisy camera in a real room."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.camera_check import FloorMonitor, FloorState, diagnose_depth
from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.occupancy.host import occupancy_update
from onemap_shared.camera import Intrinsics, unproject
from onemap_shared.geometry import F32, F64, check_rigid, transform
from onemap_shared.messages import Occupancy
from tests.mapper import scenes

DATA = Path(__file__).parents[2].parent / "shared" / "data" / "rgbd_study"
PARAMS = scenes.params()

pytestmark = pytest.mark.skipif(not DATA.exists(), reason=f"no recording in {DATA}")


@cache
def recording() -> tuple[Intrinsics, dict[str, tuple[F32, F64]]]:
    """The camera, and per frame depth (H, W) float32 metres and T_map_camera."""
    document: dict[str, Any] = json.loads((DATA / "frames.json").read_text())
    camera = document["camera"]
    frames = {}
    for frame in document["frames"]:
        depth_mm = cv2.imread(str(DATA / frame["depth"]), cv2.IMREAD_UNCHANGED)
        assert depth_mm is not None, frame["depth"]
        T = check_rigid(np.array(frame["T_map_camera"]), frame["id"])
        frames[str(frame["id"])] = (np.divide(depth_mm, 1000, dtype=np.float32), T)
    return Intrinsics(camera["fx"], camera["fy"], camera["cx"], camera["cy"]), frames


@pytest.fixture(scope="module")
def room() -> BeliefMap:
    intrinsics, frames = recording()
    belief = BeliefMap(PARAMS)
    for depth_m, T in frames.values():
        cloud = PointCloud.of(depth_m, intrinsics=intrinsics, T_map_camera=T)
        seen = occupancy_update(cloud, PARAMS)
        belief.fuse_occupancy(seen, belief.grow(seen.cells))
    return belief


def test_the_floor_lies_at_zero_wherever_it_is_seen() -> None:
    intrinsics, frames = recording()
    monitor, seen = FloorMonitor(), 0
    for at_s, (depth_m, T) in enumerate(frames.values()):
        check = diagnose_depth(PointCloud.of(depth_m, intrinsics=intrinsics, T_map_camera=T))
        if check.surface is not None:
            seen += 1
            assert abs(check.surface.height_m) < 0.02
            monitor = monitor.with_surface(check.surface, check.viewpoint, at_s)
        assert monitor.assessment(at_s).problem == ""
    assert seen >= 3
    assert monitor.assessment(len(frames)).state is FloorState.CONSISTENT


# Pixels of the first frame, chosen in its image.
@pytest.mark.parametrize(
    ("thing", "column", "row", "state"),
    [
        ("sofa seat", 330, 340, Occupancy.OCCUPIED),
        ("sofa back", 300, 240, Occupancy.OCCUPIED),
        ("table", 270, 140, Occupancy.OCCUPIED),
        ("bookshelf", 565, 140, Occupancy.OCCUPIED),
        ("green chair", 20, 250, Occupancy.OCCUPIED),
        ("floor left of the sofa", 100, 400, Occupancy.FREE),
        ("floor behind the sofa", 110, 230, Occupancy.FREE),
        ("floor right of the sofa", 480, 220, Occupancy.FREE),
    ],
)
def test_furniture_is_occupied_and_floor_is_free(
    room: BeliefMap, thing: str, column: int, row: int, state: Occupancy
) -> None:
    intrinsics, frames = recording()
    depth_m, T = next(iter(frames.values()))
    point = transform(T, unproject(depth_m, intrinsics)[row, column].astype(np.float64))
    found = room.occupancy_grid()[tuple(room.grid.cells(point))]
    assert found == state, f"{thing} at {point.round(2)}"
