"""Transforms, grids and cameras; trails, rates."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_shared import geometry
from onemap_shared.camera import Intrinsics, unproject_to_map
from onemap_shared.grid import MAX_CELLS, GridSpec, GridTooLarge, world_cells
from onemap_shared.rates import WINDOW_S, RateMeter
from onemap_shared.trail import extended
from tests.reference.mapping import unproject

angles = st.floats(-20, 20)
coordinates = st.floats(-100, 100)


@given(coordinates, coordinates, angles)
def test_inverse_undoes_a_pose(x: float, y: float, yaw: float) -> None:
    T_map_body = geometry.pose_2d(x, y, yaw)
    np.testing.assert_allclose(geometry.inverse(T_map_body) @ T_map_body, np.eye(4), atol=1e-9)


@given(coordinates, coordinates, angles)
def test_yaw_survives_a_pose(x: float, y: float, yaw: float) -> None:
    difference = geometry.wrap_angle(geometry.yaw_of(geometry.pose_2d(x, y, yaw)) - yaw)
    assert abs(difference) < 1e-9


def test_a_level_camera_looks_along_the_body() -> None:
    T_body_camera = geometry.camera_mount(0.1, 1.0, 0.0)
    ahead_right_below = np.array([[0.5, 0.25, 2.0]])  # camera: right, down, forward
    np.testing.assert_allclose(
        geometry.transform(T_body_camera, ahead_right_below), [[2.1, -0.5, 0.75]], atol=1e-12
    )


NOT_RIGID = {
    "shape": (np.eye(3), "shape"),
    "nan": (np.full((4, 4), np.nan), "NaN"),
    "huge": (np.full((4, 4), 1e300) * [1, -1, 1, -1], "not rigid"),
    "scaled": (np.diag([2.0, 2.0, 2.0, 1.0]), "not rigid"),
    "mirror": (np.diag([1.0, 1.0, -1.0, 1.0]), "reflection"),
    "projective": (np.vstack([np.eye(4)[:3], [0, 0, 1, 1]]), "last row"),
    "far": (np.array(geometry.pose_2d(1e6, 0, 0)), "units metres"),
}


@pytest.mark.parametrize("case", NOT_RIGID)
def test_what_is_not_a_rigid_transform_is_refused(case: str) -> None:
    T, reason = NOT_RIGID[case]
    with pytest.raises(ValueError, match=reason):
        geometry.check_rigid(T, "T_map_camera")


origins = st.tuples(st.integers(-500, 500), st.integers(-500, 500))
shapes = st.tuples(st.integers(0, 400), st.integers(0, 400))
sizes = st.sampled_from([0.05, 0.1, 0.25, 1.0])
grids = st.builds(GridSpec, sizes, origins, shapes)
places = st.floats(-200, 200)
corners = st.floats(-100, 100)  # 16 million cells of 0.05 m


@given(grids, st.integers(-600, 600), st.integers(-600, 600))
def test_a_cell_contains_its_own_centre(grid: GridSpec, ix: int, iy: int) -> None:
    cell = np.array([ix, iy])
    np.testing.assert_array_equal(grid.cells(grid.centres(cell)), cell)


@given(grids, places, places)
def test_cells_agree_with_the_obvious_floor(grid: GridSpec, x: float, y: float) -> None:
    obvious = [
        math.floor(x / grid.cell_size_m) - grid.origin_cell[0],
        math.floor(y / grid.cell_size_m) - grid.origin_cell[1],
    ]
    assert grid.cells(np.array([x, y])).tolist() == obvious


def test_world_cells_are_computed_in_the_precision_of_the_points() -> None:
    point = np.array([0.7, -0.7], np.float32)
    assert world_cells(point, 0.1).tolist() == [7, -7]  # in float64 0.7 of float32 is in cell 6


@given(sizes, corners, corners, corners, corners)
def test_covering_contains_both_corners(
    size: float, x0: float, y0: float, x1: float, y1: float
) -> None:
    lower, upper = (min(x0, x1), min(y0, y1)), (max(x0, x1), max(y0, y1))
    grid = GridSpec.covering(size, lower, upper)
    assert grid.contains(grid.cells(np.array([lower, upper]))).all()


@pytest.mark.parametrize("size", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_cell_sizes_are_refused(size: float) -> None:
    with pytest.raises(ValueError, match="cell_size_m"):
        GridSpec(size, (0, 0), (1, 1))


def test_no_grid_is_larger_than_memory_allows() -> None:
    assert GridSpec(0.1, (0, 0), (MAX_CELLS, 1)).shape == (MAX_CELLS, 1)
    with pytest.raises(GridTooLarge, match="did the pose jump"):
        GridSpec(0.1, (0, 0), (MAX_CELLS, 2))
    with pytest.raises(GridTooLarge, match="900001 x 900001 cells"):
        GridSpec.covering(0.1, (0.0, 0.0), (9e4, 9e4))


CAMERA = Intrinsics(11.0, 13.0, 4.2, 3.1)


@given(st.integers(1, 7), st.integers(1, 9), st.floats(0.1, 50))
def test_unprojected_points_project_back_to_their_pixel(h: int, w: int, depth_m: float) -> None:
    intrinsics = Intrinsics(11.0, 13.0, w / 2, h / 2)
    points = unproject(np.full((h, w), depth_m, np.float32), intrinsics)
    u = points[..., 0] / points[..., 2] * intrinsics.fx + intrinsics.cx - 0.5
    v = points[..., 1] / points[..., 2] * intrinsics.fy + intrinsics.cy - 0.5
    np.testing.assert_allclose(u, np.broadcast_to(np.arange(w), (h, w)), atol=1e-4)
    np.testing.assert_allclose(v, np.broadcast_to(np.arange(h)[:, None], (h, w)), atol=1e-4)


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(-4, 4), st.floats(-0.5, 1.0))
def test_unprojecting_to_the_map_is_unprojecting_and_transforming(
    x: float, y: float, yaw: float, pitch: float
) -> None:
    T_map_camera = geometry.pose_2d(x, y, yaw) @ geometry.camera_mount(0.1, 1.0, pitch)
    depth_m = np.linspace(0, 8, 6 * 9, dtype=np.float32).reshape(6, 9)
    slow = geometry.transform(T_map_camera, unproject(depth_m, CAMERA).astype(np.float64))
    fast = unproject_to_map(depth_m, CAMERA, T_map_camera)
    assert fast.dtype == np.float32
    np.testing.assert_allclose(fast, slow, atol=1e-4)


@pytest.mark.parametrize("values", [(0, 1, 1, 1), (1, -1, 1, 1), (1, 1, float("nan"), 1)])
def test_impossible_intrinsics_are_refused(values: tuple[float, float, float, float]) -> None:
    with pytest.raises(ValueError, match="focal lengths"):
        Intrinsics(*values)


@pytest.mark.parametrize("camera", [Intrinsics(1e-3, 9, 4, 3), Intrinsics(9, 9, 4, 1e6)])
def test_a_camera_that_sees_kilometres_aside_is_refused(camera: Intrinsics) -> None:
    CAMERA.check_image(9, 6)
    with pytest.raises(ValueError, match="aside at 1 m"):
        camera.check_image(9, 6)


def test_a_trail_grows_by_steps_that_are_long_enough() -> None:
    trail = extended((), (0.0, 0.0), step_m=0.1)
    assert extended(trail, (0.05, 0.0), step_m=0.1) == ((0.0, 0.0),)
    assert extended(trail, (0.06, 0.08), step_m=0.1) == ((0.0, 0.0), (0.06, 0.08))


def test_a_jump_starts_a_new_trail() -> None:
    trail = ((0.0, 0.0), (0.5, 0.0))
    assert extended(trail, (9.0, 0.0), step_m=0.1, jump_m=1.0) == ((9.0, 0.0),)
    assert len(extended(trail, (9.0, 0.0), step_m=0.1)) == 3


def metered(times_s: list[float]) -> RateMeter:
    meter = RateMeter()
    for at in times_s:
        meter = meter.with_event(at)
    return meter


@given(st.floats(0.5, 100), st.integers(4, 300))
def test_a_steady_stream_has_its_rate_at_and_between_events(rate_hz: float, count: int) -> None:
    times = [k / rate_hz for k in range(count)]
    meter = metered(times)
    assert meter.rate_hz(times[-1]) == pytest.approx(rate_hz, rel=1e-6)
    assert meter.rate_hz(times[-1] + 0.5 / rate_hz) == pytest.approx(rate_hz, rel=0.2)


def test_a_stalled_stream_s_rate_falls_to_nothing() -> None:
    meter = metered([k / 10 for k in range(51)])
    rates = [meter.rate_hz(5.0 + stall) for stall in (0.0, 1.0, 3.0, WINDOW_S + 0.1)]
    assert rates == sorted(rates, reverse=True)
    assert rates[0] == pytest.approx(10.0)
    assert rates[-1] == 0.0


def test_silence_is_counted_from_the_newest_event_or_the_start() -> None:
    assert RateMeter().silent_s(4.0, since_s=1.0) == 3.0
    assert metered([0.0, 2.0]).silent_s(100.0, since_s=0.0) == 98.0
