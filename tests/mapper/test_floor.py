"""Floor and drops in depth images of a floor that ends at a step down, or goes on."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.occupancy.floor import floor_points
from onemap_mapper.occupancy.image import occupancy_update
from onemap_mapper.params import MapParams
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, camera_mount, pose_2d
from onemap_shared.messages import Layer, Occupancy
from tests.mapper import scenes
from tests.mapper.scenes import Box

PARAMS = scenes.params()
CAMERA = Intrinsics.from_fov(320, 240, np.deg2rad(79))
SIZE = (240, 320)
EDGE_M = 3.0
FLOOR = (Box((-9, -9, -4), (9, 9, 0)),)
MOUNTS = [(0.3, 0.0), (0.6, 30.0), (1.0, 12.0), (1.2, 0.0)]
NO_RETURN = 99.0  # a fall so deep that no depth comes back


def step_down(fall_m: float) -> tuple[Box, ...]:
    """Floor at z = 0 up to x = EDGE_M, then lower by ``fall_m``."""
    here = Box((-9, -9, -4), (EDGE_M, 9, 0))
    if fall_m == NO_RETURN:
        return (here,)
    return (here, Box((EDGE_M, -9, -8), (12, 9, -fall_m)))


def tilted(pitch_deg: float, roll_deg: float) -> F64:
    """An error of the body's attitude (4, 4)."""
    p, r = np.radians(pitch_deg), np.radians(roll_deg)
    T = np.eye(4)
    R_pitch = [[np.cos(p), 0, np.sin(p)], [0, 1, 0], [-np.sin(p), 0, np.cos(p)]]
    R_roll = [[1, 0, 0], [0, np.cos(r), -np.sin(r)], [0, np.sin(r), np.cos(r)]]
    T[:3, :3] = np.array(R_pitch) @ R_roll
    return T


@cache
def true_depth(boxes: tuple[Box, ...], x_m: float, height_m: float, pitch_deg: float) -> F32:
    T = pose_2d(x_m, 0, 0) @ camera_mount(0.1, height_m, np.deg2rad(pitch_deg))
    return scenes.depth_of(boxes, T, CAMERA, SIZE)


def seen(
    boxes: tuple[Box, ...],
    mount: tuple[float, float],
    *,
    noise: float = 0.0,
    attitude_deg: float = 0.0,
    seed: int = 0,
    params: MapParams = PARAMS,
) -> BeliefMap:
    """The map of a drive along x up to 1.2 m before the edge."""
    rng, belief = np.random.default_rng(seed), BeliefMap(params)
    for x_m in np.linspace(0.0, EDGE_M - 1.2, 7):
        depth = true_depth(boxes, float(x_m), *mount)
        depth = depth + noise * depth**2 * rng.standard_normal(SIZE, np.float32)
        depth = np.where((depth > 0.1) & (depth < 8), np.rint(depth * 1000) / 1000, 0)
        position = rng.normal(0, 0.02, 2) * (attitude_deg > 0)
        yaw, pitch, roll = rng.normal(0, attitude_deg, 3)
        body = pose_2d(x_m + position[0], position[1], np.deg2rad(yaw)) @ tilted(pitch, roll)
        T = body @ camera_mount(0.1, mount[0], np.deg2rad(mount[1]))
        cloud = PointCloud.of(depth.astype(np.float32), intrinsics=CAMERA, T_map_camera=T)
        frame = occupancy_update(cloud, params)
        belief.fuse_occupancy(frame, belief.grow(frame.cells))
    return belief


def states(belief: BeliefMap, x_m: F64, y_m: F64) -> F64:
    """States (len(x), len(y)) of the cells at these coordinates."""
    xy = np.stack(np.meshgrid(x_m, y_m, indexing="ij"), axis=-1)
    cells = belief.grid.cells(xy)
    inside = belief.grid.contains(cells)
    found = np.full(inside.shape, int(Occupancy.UNKNOWN))
    found[inside] = belief.shared_version().occupancy_grid()[tuple(cells[inside].T)]
    return found


ACROSS = np.arange(-0.95, 1.0, 0.1)
AT_EDGE = np.arange(EDGE_M - 0.35, EDGE_M + 0.5, 0.1)
BEYOND = np.arange(EDGE_M + 0.15, EDGE_M + 2.5, 0.1)


@pytest.mark.parametrize("mount", MOUNTS)
@pytest.mark.parametrize("fall_m", [0.10, 0.18, 0.5, 3.0, NO_RETURN])
def test_the_edge_of_a_step_down_is_closed(fall_m: float, mount: tuple[float, float]) -> None:
    belief = seen(step_down(fall_m), mount, noise=0.002)
    assert (states(belief, AT_EDGE, ACROSS) == Occupancy.OCCUPIED).any(axis=0).all()
    before = states(belief, np.arange(2.15, EDGE_M - 0.3, 0.1), ACROSS)
    assert (before == Occupancy.FREE).mean() > 0.95
    if fall_m >= 0.18:
        assert (states(belief, BEYOND, ACROSS) == Occupancy.FREE).mean() < 0.02


@pytest.mark.parametrize("mount", MOUNTS)
def test_flat_floor_has_no_edge_in_spite_of_noise(mount: tuple[float, float]) -> None:
    belief = seen(FLOOR, mount, noise=0.005, attitude_deg=1.0, seed=8)
    assert (belief.occupancy.evidence.values[:, -1] < 3).all()
    assert (states(belief, np.arange(2.25, 3.5, 0.1), ACROSS) == Occupancy.FREE).mean() > 0.95


def test_small_holes_in_the_depth_are_no_drops() -> None:
    rng = np.random.default_rng(3)
    depth = true_depth(FLOOR, 0.0, 1.0, 12.0)
    T = pose_2d(0, 0, 0) @ camera_mount(0.1, 1.0, np.deg2rad(12.0))
    depth = np.where(rng.random(SIZE) < 0.3, 0, depth).astype(np.float32)
    depth[150:158, 100:108] = 0
    holes = floor_points(PointCloud.of(depth, intrinsics=CAMERA, T_map_camera=T), PARAMS)
    assert len(holes.drops) == 0
    depth[130:180, 100:180] = 0
    hole = floor_points(PointCloud.of(depth, intrinsics=CAMERA, T_map_camera=T), PARAMS)
    assert len(hole.drops) > 0


@pytest.mark.parametrize("below", [0.4, 3.0, NO_RETURN])
def test_an_opening_is_closed_on_all_sides(below: float) -> None:
    """A stairwell of 0.8 x 1 m, passed straight ahead: no free cell in it, none beside its rim."""
    opening = (
        Box((-9, -9, -4), (2.5, 9, 0)),
        Box((3.3, -9, -4), (9, 9, 0)),
        Box((2.5, -9, -4), (3.3, -0.5, 0)),
        Box((2.5, 0.5, -4), (3.3, 9, 0)),
        Box((2.5, -0.5, -9), (3.3, 0.5, -below)),
    )
    belief = BeliefMap(PARAMS)
    for x_m in (0.0, 0.5, 1.0, 1.2):
        depth = true_depth(opening, x_m, 1.0, 12.0)
        T = pose_2d(x_m, 0, 0) @ camera_mount(0.1, 1.0, np.deg2rad(12.0))
        cloud = PointCloud.of(depth, intrinsics=CAMERA, T_map_camera=T)
        if below == NO_RETURN:
            depth = np.where(cloud.z_m < -0.005, 0, depth).astype(np.float32)
            cloud = PointCloud.of(depth, intrinsics=CAMERA, T_map_camera=T)
        frame = occupancy_update(cloud, PARAMS)
        belief.fuse_occupancy(frame, belief.grow(frame.cells))
    inside = states(belief, np.arange(2.65, 3.1, 0.1), np.arange(-0.35, 0.4, 0.1))
    assert (inside == Occupancy.OCCUPIED).mean() > 0.9
    assert not (inside == Occupancy.FREE).any()
    beside = states(belief, np.arange(2.65, 3.1, 0.1), np.array([-0.65, -0.55, 0.55, 0.65]))
    assert (beside == Occupancy.FREE).mean() > 0.5


@pytest.mark.parametrize(
    "place",
    [(-0.6, -0.6, 10.0), (-2.4, 0.6, -5.0), (2.0, 2.2, -70.0)],
    ids=["afar", "beyond the range of drops", "aside"],
)
def test_an_edge_stays_known_where_floor_is_seen_beside_it(
    place: tuple[float, float, float],
) -> None:
    """The opening begins within cells, in which the camera sees floor as well."""
    low, high, side = 2.56, 3.3, 0.47
    opening = (
        Box((-9, -9, -4), (low, 9, 0)),
        Box((high, -9, -4), (9, 9, 0)),
        Box((low, -9, -4), (high, -side, 0)),
        Box((low, side, -4), (high, 9, 0)),
        Box((low, -side, -9), (high, side, -3)),
    )
    camera, belief = Intrinsics.from_fov(160, 120, np.deg2rad(79)), BeliefMap(PARAMS)
    places = np.stack(np.meshgrid([low], np.arange(-0.35, 0.4, 0.1)), axis=-1)
    for (x_m, y_m, yaw_deg), times in (((1.0, 0.0, 0.0), 8), (place, 20)):
        T = pose_2d(x_m, y_m, np.deg2rad(yaw_deg)) @ camera_mount(0.1, 1.0, np.deg2rad(12.0))
        depth = scenes.depth_of(opening, T, camera, (120, 160))
        cloud = PointCloud.of(depth, intrinsics=camera, T_map_camera=T)
        frame = occupancy_update(cloud, PARAMS)
        for _ in range(times):
            belief.fuse_occupancy(frame, belief.grow(frame.cells))
        drops = belief.shared_version().layers() & Layer.DROP
        assert drops[tuple(np.moveaxis(belief.grid.cells(places), -1, 0))].all()


@pytest.mark.parametrize("noise", [0.0, 0.003])
@pytest.mark.parametrize("pitch_deg", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("far_m", [2.6, 2.65, 2.699])
def test_the_far_edge_of_an_opening_is_closed(far_m: float, pitch_deg: float, noise: float) -> None:
    """The wall below it counts neither as floor nor as unknown, wherever cells begin."""
    pit = (
        Box((-9, -9, -4), (1.8, 9, 0)),
        Box((far_m, -9, -4), (9, 9, 0)),
        Box((1.8, -9, -9), (far_m, 9, -3)),
    )
    rng, belief = np.random.default_rng(5), BeliefMap(PARAMS)
    for x_m in (0.0, 0.2, 0.4):
        depth = true_depth(pit, x_m, 1.0, 12.0)
        depth = (depth + noise * depth**2 * rng.standard_normal(SIZE)).astype(np.float32)
        T = pose_2d(x_m, 0, 0) @ tilted(pitch_deg, 0.0) @ camera_mount(0.1, 1.0, np.deg2rad(12.0))
        frame = occupancy_update(PointCloud.of(depth, intrinsics=CAMERA, T_map_camera=T), PARAMS)
        belief.fuse_occupancy(frame, belief.grow(frame.cells))
    inside = states(belief, np.arange(1.95, far_m, 0.1), ACROSS)
    assert (inside == Occupancy.OCCUPIED).mean() > 0.95
    assert not (inside == Occupancy.FREE).any()
    beyond = states(belief, np.arange(2.85, 3.5, 0.1), ACROSS)
    assert (beyond == Occupancy.FREE).mean() > 0.95


@pytest.mark.parametrize("pitch_deg", [-2.0, -1.0, 1.0, 2.0])
def test_before_what_stands_on_a_floor_that_seems_lower_is_no_drop(pitch_deg: float) -> None:
    wall, leg = Box((3.0, 0, 0), (3.1, 9, 2)), Box((2.5, -0.5, 0), (2.55, -0.45, 0.7))
    depth = true_depth((*FLOOR, wall, leg), 0.0, 1.0, 12.0)
    T = tilted(pitch_deg, 0.0) @ camera_mount(0.1, 1.0, np.deg2rad(12.0))
    points = floor_points(PointCloud.of(depth, intrinsics=CAMERA, T_map_camera=T), PARAMS)
    assert len(points.drops) == 0
