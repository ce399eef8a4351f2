from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_shared.camera import Intrinsics, ray_directions, unproject, unproject_to_map
from onemap_shared.geometry import camera_mount, pose_2d, transform

CAMERA = Intrinsics(11.0, 13.0, 4.2, 3.1)


@given(st.integers(1, 7), st.integers(1, 9), st.floats(0.1, 50))
def test_unprojected_points_project_back_to_their_pixel(h: int, w: int, depth_m: float) -> None:
    intrinsics = Intrinsics(11.0, 13.0, w / 2, h / 2)
    points = unproject(np.full((h, w), depth_m, np.float32), intrinsics)
    u = points[..., 0] / points[..., 2] * intrinsics.fx + intrinsics.cx - 0.5
    v = points[..., 1] / points[..., 2] * intrinsics.fy + intrinsics.cy - 0.5
    np.testing.assert_allclose(u, np.broadcast_to(np.arange(w), (h, w)), atol=1e-4)
    np.testing.assert_allclose(v, np.broadcast_to(np.arange(h)[:, None], (h, w)), atol=1e-4)


@given(st.integers(1, 7), st.integers(5, 20), st.integers(5, 20))
def test_a_strided_image_keeps_the_rays_of_its_pixels(n: int, h: int, w: int) -> None:
    full = ray_directions(CAMERA, w, h)[::n, ::n]
    strided = ray_directions(CAMERA.strided(n), full.shape[1], full.shape[0])
    np.testing.assert_allclose(strided, full, atol=1e-5)


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(-4, 4), st.floats(-0.5, 1.0))
def test_unprojecting_to_the_map_is_unprojecting_and_transforming(
    x: float, y: float, yaw: float, pitch: float
) -> None:
    T_map_camera = pose_2d(x, y, yaw) @ camera_mount(0.1, 1.0, pitch)
    depth_m = np.linspace(0, 8, 6 * 9, dtype=np.float32).reshape(6, 9)
    slow = transform(T_map_camera, unproject(depth_m, CAMERA).astype(np.float64))
    fast = unproject_to_map(depth_m, CAMERA, T_map_camera)
    assert fast.dtype == np.float32
    np.testing.assert_allclose(fast, slow, atol=1e-4)


def test_the_view_s_extent_at_depth_one_spans_its_outer_pixel_edges() -> None:
    extent = CAMERA.size_over_focal(9, 6)
    edges = (CAMERA.x_at(8.5) - CAMERA.x_at(-0.5), CAMERA.y_at(5.5) - CAMERA.y_at(-0.5))
    assert extent == pytest.approx(edges)


@pytest.mark.parametrize("values", [(0, 1, 1, 1), (1, -1, 1, 1), (1, 1, float("nan"), 1)])
def test_impossible_intrinsics_are_refused(values: tuple[float, float, float, float]) -> None:
    with pytest.raises(ValueError, match="focal lengths"):
        Intrinsics(*values)


@pytest.mark.parametrize("camera", [Intrinsics(1e-3, 9, 4, 3), Intrinsics(9, 9, 4, 1e6)])
def test_a_camera_that_sees_kilometres_aside_is_refused(camera: Intrinsics) -> None:
    CAMERA.check_image(9, 6)
    with pytest.raises(ValueError, match="aside at 1 m"):
        camera.check_image(9, 6)


def test_the_matrix_has_pixel_centres_at_integers() -> None:
    camera = Intrinsics(300.0, 310.0, 160.5, 119.5)
    u, v, w = camera.matrix() @ (camera.x_at(17.0), camera.y_at(4.0), 1.0)
    assert (u / w, v / w) == pytest.approx((17.0, 4.0))
