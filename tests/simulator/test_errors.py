"""Errors of a real robot: drift, loop closures, the link of the frames, depth, people."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_shared.geometry import F32, F64, Velocity2d, pose_2d, yaw_of
from onemap_simulator.errors import (
    DepthErrorParams,
    DriftingOdometry,
    DriftParams,
    FrameLink,
    FrameLinkParams,
    Localisation,
    LoopClosures,
    RobotErrors,
)
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.people import GAP_M, NOBODY, START_AWAY_M, People, WalkableFloor
from onemap_simulator.physics.robot import RobotParams, RobotState
from onemap_simulator.physics.simulation import Simulation
from onemap_simulator.rendering.label_renderer import LabelRenderer
from onemap_simulator.rendering.rgbd_camera import (
    CameraParams,
    RgbdCamera,
    faces_without_return,
    with_depth_errors,
)
from tests.simulator.scenes import SceneBuilder, box_room


def circle(turns: float, backwards_after: float = np.inf) -> list[F64]:
    """Poses around a circle of 10 m, every 0.1 m; the heading is reversed after so many turns."""
    radius = 10 / (2 * np.pi)
    poses = []
    for k in range(round(100 * turns) + 1):
        angle = 2 * np.pi * k / 100
        flip = np.pi if k / 100 > backwards_after else 0.0
        x, y = radius * np.cos(angle), radius * np.sin(angle)
        poses.append(pose_2d(x, y, angle + np.pi / 2 + flip))
    return poses


def closures(poses: list[F64]) -> list[int]:
    known = LoopClosures()
    closed = [k for k, pose in enumerate(poses) if known.closes(pose)]
    assert known.count == len(closed)
    return closed


DRIFT = DriftParams(way_percent=2.0, yaw_deg_per_m=0.5)
BIAS_ONLY = replace(DRIFT, random_walk=0.0)


def straight_on(drift: DriftingOdometry, metres: int, every_m: float = 0.1) -> F64:
    """The pose reported after a straight way along x."""
    drift.reported(np.eye(4))
    for k in range(1, round(metres / every_m) + 1):
        reported = drift.reported(pose_2d(k * every_m, 0.0, 0.0))
    return reported


@pytest.mark.parametrize("seed", range(4))
def test_each_run_has_a_bias_within_the_limits_and_of_its_own(seed: int) -> None:
    drift = DriftingOdometry(BIAS_ONLY, np.random.default_rng(seed))
    reported = straight_on(drift, 10)
    assert 0.125 <= abs(np.degrees(yaw_of(reported))) / 10 <= 0.5
    other = straight_on(DriftingOdometry(BIAS_ONLY, np.random.default_rng(seed + 100)), 10)
    assert yaw_of(reported) != yaw_of(other)
    length_only = replace(BIAS_ONLY, yaw_deg_per_m=0.0)
    along = straight_on(DriftingOdometry(length_only, np.random.default_rng(seed)), 10)
    assert 0.05 <= abs(along[0, 3] - 10) <= 0.2
    assert along[1, 3] == 0


def localisation(drift: DriftParams | None = DRIFT, closing: bool = False) -> Localisation:
    return Localisation(RobotErrors(drift, closing), np.random.default_rng(1))


def test_a_loop_closure_takes_the_pose_back_to_the_true_one_at_once() -> None:
    poses = circle(1.2)
    jumping = localisation(closing=True)
    errors = [np.linalg.norm((jumping.reported(pose) - pose)[:2, 3]) for pose in poses]
    assert jumping.jumps == 1
    closed = int(np.argmin(errors[50:])) + 50
    assert errors[closed] == 0.0
    assert errors[closed - 1] > 0.1
    assert jumping.largest_error_m == pytest.approx(max(errors))
    drifting = localisation()
    errors_without = [np.linalg.norm((drifting.reported(pose) - pose)[:2, 3]) for pose in poses]
    assert errors_without[:closed] == errors[:closed]
    assert errors_without[closed] > 0.02


def link(**values: float) -> FrameLink[int]:
    return FrameLink(FrameLinkParams(**values), np.random.default_rng(4))


def test_late_frames_arrive_in_their_order_within_the_limits() -> None:
    late = link(min_delay_s=0.1, max_delay_s=0.6)
    arrivals: dict[int, float] = {}
    for tick in range(2200):
        now_s = tick / 100
        if tick % 25 == 0 and tick < 2000:
            late.send(tick // 25, now_s)
        arrivals.update(dict.fromkeys(late.arrived(now_s), now_s))
    assert list(arrivals) == list(range(80))
    delays = np.array([arrivals[k] - k / 4 for k in range(80)])
    assert delays.min() >= 0.1
    assert delays.max() <= 0.62
    assert delays.std() > 0.05
    assert late.lost == 0


def test_frames_are_lost_as_often_and_in_bursts_as_long_as_set() -> None:
    losing = link(lost_share=0.2)
    for k in range(20000):
        losing.send(k, float(k))
    kept = losing.arrived(20000.0)
    assert losing.lost == 20000 - len(kept)
    assert losing.lost / 20000 == pytest.approx(0.2, abs=0.03)
    gaps = np.diff(kept) - 1
    assert gaps[gaps > 0].mean() == pytest.approx(4.0, rel=0.15)


CAMERA = CameraParams(width=160, height=120)


def two_walls() -> F32:
    """Depth (40, 60): a wall at 3 m, to the right of column 29 one at 2 m."""
    depth = np.full((40, 60), 3.0, np.float32)
    depth[:, 30:] = 2.0
    return depth


def measured(depth: F32, params: DepthErrorParams, seed: int = 0) -> F32:
    faces = np.full(depth.shape, -1, np.int32)
    rng = np.random.default_rng(seed)
    return with_depth_errors(depth, faces, np.array([False]), params, rng)


def test_pixels_at_edges_fly_between_front_and_back_or_have_no_return() -> None:
    params = DepthErrorParams(edge_flying=0.3, edge_holes=0.3)
    images = np.array([measured(two_walls(), params, seed) for seed in range(50)])
    at_edge, elsewhere = images[:, :, 29:31], np.delete(images, (29, 30), axis=2)
    assert (at_edge == 0).mean() == pytest.approx(0.3, abs=0.03)
    assert ((at_edge > 2) & (at_edge < 3)).mean() == pytest.approx(0.3, abs=0.03)
    np.testing.assert_array_equal(np.unique(elsewhere), (2.0, 3.0))
    np.testing.assert_array_equal(measured(two_walls(), params, 7), images[7])


def test_glass_and_black_surfaces_give_no_return() -> None:
    black = np.full((2, 2, 3), 10, np.uint8)
    builder = SceneBuilder()
    builder.add("wall", (4, -3, 0), (4.1, 3, 3))
    builder.add("window", (3.9, -2, 0.5), (3.95, -0.5, 2))
    builder.add("television", (3.9, 0.5, 0.5), (3.95, 2, 1.5), texture=black)
    scene = builder.build()
    params = DepthErrorParams(dark_below=25.0, glass=True)
    camera = RgbdCamera(scene, LabelRenderer(scene), CAMERA, np.random.default_rng(0), params)
    image = camera.capture(RobotState(0.0, 0.0, 0.0).pose)
    labels = (
        LabelRenderer(scene).render(CAMERA.mount, CAMERA.intrinsics, width=160, height=120).labels
    )
    assert (image.depth_mm[labels == 0] > 0).all()
    assert min((labels == 1).sum(), (labels == 2).sum()) > 50
    assert (image.depth_mm[labels > 0] == 0).all()
    assert not faces_without_return(scene, DepthErrorParams()).any()


ROOM = box_room()
FLOOR = WalkableFloor.of(ROOM, 0.25)


def people(count: int = 3, seed: int = 0, robot_xy: tuple[float, float] = (1.0, 1.0)) -> People:
    rng = np.random.default_rng(seed)
    return People(FLOOR, count, rng, robot_xy=robot_xy, robot_radius_m=0.2)


def walked(walkers: People, seconds: float, robot_xy: tuple[float, float] = (9.0, 9.0)) -> F64:
    """Places (steps, people, 2) every 0.02 s."""
    steps = []
    for _ in range(round(seconds / 0.02)):
        walkers.advance(0.02, robot_xy)
        steps.append(walkers.bystanders.places)
    return np.array(steps)


def test_people_walk_on_free_floor_at_most_as_fast_as_set_and_a_seed_repeats_it() -> None:
    steps = walked(people(), 40.0)
    collision = CollisionMap.of(ROOM, 1.7)
    clearances = [collision.clearance_m(*place) for place in steps[::10].reshape(-1, 2)]
    assert min(clearances) >= 0.2
    speeds = np.linalg.norm(np.diff(steps, axis=0), axis=-1) / 0.02
    assert speeds.max() <= 1.0 + 1e-6
    assert np.median(speeds) >= 0.4
    assert np.ptp(steps, axis=0).min() > 0.5  # each gets about
    np.testing.assert_array_equal(steps, walked(people(), 40.0))
    assert not np.array_equal(steps, walked(people(seed=1), 40.0))


def test_people_start_away_from_the_robot_and_stop_before_it() -> None:
    for seed in (0, 4):
        robot_xy = (2.0, 1.5)
        walkers = people(2, seed, robot_xy)
        start = np.linalg.norm(walkers.bystanders.places - robot_xy, axis=1)
        assert start.min() >= START_AWAY_M
        steps = walked(walkers, 60.0, robot_xy)
        away = np.linalg.norm(steps - robot_xy, axis=-1)
        assert away.min() >= 0.25 + 0.2 + GAP_M - 1e-9
    assert away.min() < 1.0  # they do come near
    assert walkers.distance_m(*steps[-1, 0]) == pytest.approx(-0.25)


class Statue(People):
    """One person who never moves, at (2, 1.5)."""

    def __init__(self) -> None:
        super().__init__(
            FLOOR, 1, np.random.default_rng(0), robot_xy=(9.0, 9.0), robot_radius_m=0.2
        )
        self._walkers[0].place = (2.0, 1.5)

    def advance(self, dt_s: float, robot_xy: tuple[float, float]) -> None:
        """Stand still."""


def test_driving_into_a_person_is_a_contact_and_counted_as_such() -> None:
    def drive(who: People | None, start: RobotState) -> Simulation:
        run = Simulation(CollisionMap.of(ROOM, 1.1), RobotParams(), start, now_s=0.0, people=who)
        for k in range(1, 100):
            run.receive_command(Velocity2d(0.5), k * 0.02, validity_s=0.3)
            run.advance(k * 0.02)
        return run

    touched = drive(Statue(), RobotState(1.0, 1.5, 0.0))
    assert (touched.counts.collisions > 0, touched.counts.people_touched > 0) == (True, True)
    assert touched.counts.people_touched == touched.counts.collisions
    assert touched.state.x_m <= 2.0 - 0.45
    assert len(touched.bystanders.places) == 1
    wall = drive(Statue(), RobotState(1.0, 2.5, np.pi))
    assert wall.counts.collisions > 0
    assert wall.counts.people_touched == 0
    alone = drive(None, RobotState(1.0, 1.5, 0.0))
    assert alone.counts.collisions == 0
    assert alone.bystanders is NOBODY
