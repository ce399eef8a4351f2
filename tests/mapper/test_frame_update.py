"""What one frame adds: projection and blur against the double loop, flying pixels."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.frame.blur import MIN_WEIGHT, blur_kernel
from onemap_mapper.occupancy.image import flying_pixels
from onemap_mapper.params import MapParams
from onemap_shared.camera import Intrinsics, ray_directions
from onemap_shared.geometry import F32, camera_mount
from tests.reference import mapping as slow


@given(seed=st.integers(0, 2**16), half_width=st.integers(0, 3), factor=st.floats(0, 0.05))
@settings(max_examples=25, deadline=None)
def test_agrees_with_the_double_loop(seed: int, half_width: int, factor: float) -> None:
    rng = np.random.default_rng(seed)
    cells = np.unique(rng.integers(-30, 30, (rng.integers(1, 40), 2)), axis=0)
    features = rng.normal(size=(len(cells), 3)).astype(np.float32)
    confidence = rng.uniform(0.1, 1, len(cells)).astype(np.float32)
    params = MapParams(depth_factor=factor, blur_half_width_cells=half_width)
    fast = blur_kernel(cells, camera_xy_m=np.array([-0.3, 0.2]), params=params)
    seen: slow.Cells = {
        (int(x), int(y)): (features[i].astype(np.float64), float(confidence[i]))
        for i, (x, y) in enumerate(cells)
    }
    expected = slow.blurred(
        seen,
        camera_xy_m=(-0.3, 0.2),
        cell_size_m=0.1,
        depth_factor=factor,
        half_width=half_width,
    )
    values, weights = slow.table(expected, fast.cells)
    tolerance = 49 * MIN_WEIGHT * 4  # what may be left out, times the largest feature
    found = fast.rows.times(torch.from_numpy(features))
    np.testing.assert_allclose(found.numpy(), values, atol=tolerance)
    np.testing.assert_allclose(fast.confidence(confidence), weights, atol=tolerance)
    kept = {(int(x), int(y)) for x, y in fast.cells}
    assert all(c < tolerance for cell, (_, c) in expected.items() if cell not in kept)


SIZE = (120, 160)
CAMERA = Intrinsics.from_fov(SIZE[1], SIZE[0], np.deg2rad(79))


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


@pytest.mark.parametrize(("height_m", "pitch_rad"), [(1.0, 0.26), (0.3, 0.0), (1.2, 0.0)])
def test_surfaces_clean_edges_and_a_thin_pole_are_kept(height_m: float, pitch_rad: float) -> None:
    """Of the floor, too, which lies at a flat angle."""
    pole = np.full(SIZE, 4.0, np.float32)
    pole[20:100, 70] = 1.5
    assert not flying_pixels(wall_and_box()).any()
    assert not flying_pixels(pole)[21:99].any()
    assert not flying_pixels(floor(height_m, pitch_rad)).any()


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
