"""The lowest level surface of one image: floors and tables count, walls and noise do not."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.frame import camera_check
from onemap_mapper.frame.camera_check import LevelSurface, lowest_level_surface
from onemap_mapper.frame.cloud import PointCloud
from onemap_shared.camera import Intrinsics, unproject
from onemap_shared.geometry import F32, F64
from tests.mapper import scenes

SIZE = (240, 320)
CAMERA = Intrinsics.from_fov(SIZE[1], SIZE[0], np.radians(79.0))
TABLE = scenes.Box((0.3, -2.5, 0.5), (3.0, 2.5, 0.55))
CABINET = scenes.Box((0.8, -2.0, 0.0), (1.4, 2.0, 2.2))


def depth_of(*boxes: scenes.Box, T_map_camera: F64 | None = None) -> F32:
    T = scenes.pose() if T_map_camera is None else T_map_camera
    return scenes.depth_of((*scenes.ROOM, *boxes), T, CAMERA, SIZE)


def surface_in(depth_m: F32, T_believed: F64 | None = None) -> LevelSurface | None:
    T = scenes.pose() if T_believed is None else T_believed
    cloud = PointCloud.of(depth_m, intrinsics=CAMERA, T_map_camera=T)
    compiled = lowest_level_surface(cloud)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(camera_check, "AVAILABLE", False)
        found = lowest_level_surface(cloud)
    assert (found is None) == (compiled is None)
    if found is not None and compiled is not None:
        assert compiled.height_m == pytest.approx(found.height_m, abs=1e-6)
        assert compiled.tilt_rad == pytest.approx(found.tilt_rad, abs=1e-5)
    return found


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


def test_the_floor_is_found_below_a_table() -> None:
    table = scenes.Box((0.8, -0.4, 0.5), (1.6, 0.4, 0.55))
    assert height_in(depth_of(table)) == pytest.approx(0.0, abs=0.01)


def test_a_table_that_fills_the_view_is_what_is_seen() -> None:
    assert height_in(depth_of(TABLE)) == pytest.approx(0.55, abs=0.01)


@pytest.mark.parametrize("noise_m", [0.0, 0.01])
def test_noise_that_grows_with_the_square_of_the_distance_leaves_the_floor(noise_m: float) -> None:
    depth_m = depth_of()
    error = np.random.default_rng(1).standard_normal(SIZE)
    noisy = (depth_m + noise_m * depth_m**2 * error).astype(np.float32)
    surface = surface_in(noisy)
    assert surface is not None
    assert abs(surface.height_m) < 0.02
    assert np.degrees(surface.tilt_rad) < 1.0


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
