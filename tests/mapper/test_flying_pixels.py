"""Pixels between two surfaces are dropped, those of surfaces are not, however slanted."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.occupancy.host import few_alike
from onemap_shared.camera import Intrinsics, ray_directions
from onemap_shared.geometry import F32, Bool, camera_mount

SIZE = (120, 160)
CAMERA = Intrinsics.from_fov(SIZE[1], SIZE[0], np.deg2rad(79))


def flying_pixels(depth_m: F32) -> Bool:
    return few_alike(depth_m)


def wall_and_box() -> F32:
    """A wall at 4 m with a box at 2 m before it."""
    depth_m = np.full(SIZE, 4.0, np.float32)
    depth_m[40:80, 50:110] = 2.0
    return depth_m


def floor(height_m: float, pitch_rad: float) -> F32:
    """Depth of the floor up to 5 m away, from a camera at this height; 0 beyond."""
    rays = ray_directions(CAMERA, width=SIZE[1], height=SIZE[0])
    down = -(rays @ camera_mount(0.0, height_m, pitch_rad)[:3, :3].T)[..., 2]
    with np.errstate(divide="ignore"):
        depth_m = np.where(down > 0, height_m / down, 0.0)
    return np.where(depth_m <= 5.0, depth_m, 0.0).astype(np.float32)


def test_surfaces_and_clean_edges_are_kept() -> None:
    assert not flying_pixels(wall_and_box()).any()
    assert not flying_pixels(np.zeros(SIZE, np.float32)).any()


@pytest.mark.parametrize(("height_m", "pitch_rad"), [(1.0, 0.26), (0.3, 0.0), (1.2, 0.0)])
def test_floor_at_a_flat_angle_is_kept(height_m: float, pitch_rad: float) -> None:
    assert not flying_pixels(floor(height_m, pitch_rad)).any()


def test_a_thin_pole_is_kept() -> None:
    depth_m = np.full(SIZE, 4.0, np.float32)
    depth_m[20:100, 70] = 1.5
    assert not flying_pixels(depth_m)[21:99].any()


def test_nearly_all_flying_pixels_are_dropped_and_nearly_nothing_else() -> None:
    rng = np.random.default_rng(0)
    depth_m = wall_and_box()
    depth_m += rng.normal(0.0, 0.004 * depth_m**2).astype(np.float32)
    edge = np.zeros(SIZE, bool)
    edge[40:80, [49, 50, 109, 110]] = True
    flying = edge & (rng.random(SIZE) < 0.3)
    depth_m[flying] = rng.uniform(2.2, 3.8, int(flying.sum()))
    dropped = flying_pixels(depth_m)
    assert dropped[flying].mean() > 0.9
    assert dropped[~flying].mean() < 0.005
