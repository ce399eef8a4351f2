"""Driving: within limits, along the path, to its end."""

import math
from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_planner.motion.motions import STOP, Drive, Motion, Pose2d, Rest, Reverse, Rotate, moved
from onemap_planner.motion.pure_pursuit import (
    DriveParams,
    arrived,
    limit_acceleration,
    target_velocity,
    top_speed_mps,
)
from onemap_shared.geometry import Velocity2d
from tests.planner.drawn_maps import PARAMS, costmap_of, drawn_map

DRIVE = PARAMS.drive
HOLONOMIC = DRIVE.model_copy(update={"max_lateral_mps": 0.3})
OPEN = costmap_of(drawn_map(*["." * 10] * 10, scale=5), (1.0, 1.0), PARAMS.costmap)

places = st.tuples(st.floats(0.0, 5.0), st.floats(0.0, 5.0))
poses = st.builds(Pose2d, st.floats(0, 5), st.floats(0, 5), st.floats(-math.pi, math.pi))
speeds = st.builds(Velocity2d, st.floats(-0.7, 0.7), st.floats(-1.5, 1.5))
motions: st.SearchStrategy[Motion] = st.one_of(
    st.just(Rest()),
    st.just(Rotate()),
    st.just(Reverse()),
    st.builds(lambda p, look: Drive(np.array(p), look), st.lists(places, min_size=1), places),
)


@given(motions, poses)
def test_the_wanted_velocity_keeps_the_speed_limits(motion: Motion, pose: Pose2d) -> None:
    for costmap in (OPEN, None):
        wanted = target_velocity(motion, pose, costmap, DRIVE)
        assert abs(wanted.linear_mps) <= DRIVE.max_linear_mps + 1e-9
        assert abs(wanted.angular_radps) <= DRIVE.max_angular_radps + 1e-9
        assert wanted.lateral_mps == 0.0  # a differential drive


@given(motions, poses)
def test_a_holonomic_robot_keeps_the_limits_of_its_direction(motion: Motion, pose: Pose2d) -> None:
    wanted = target_velocity(motion, pose, OPEN, HOLONOMIC)
    assert abs(wanted.angular_radps) <= HOLONOMIC.max_angular_radps + 1e-9
    if isinstance(motion, Drive):
        assert wanted.linear_mps >= -1e-9  # it turns before it drives backwards
        bearing = math.atan2(wanted.lateral_mps, wanted.linear_mps)
        assert wanted.speed_mps <= top_speed_mps(bearing, HOLONOMIC) + 1e-9
        assert abs(wanted.lateral_mps) <= HOLONOMIC.max_lateral_mps + 1e-9
    else:
        assert wanted == target_velocity(motion, pose, OPEN, DRIVE)


@given(speeds, speeds, st.floats(0.0, 0.2))
def test_the_command_keeps_the_acceleration_limits(
    wanted: Velocity2d, previous: Velocity2d, dt_s: float
) -> None:
    command = limit_acceleration(wanted, previous, dt_s, DRIVE)
    change = command.linear_mps - previous.linear_mps
    turn = command.angular_radps - previous.angular_radps
    assert abs(change) <= DRIVE.max_linear_mps2 * dt_s + 1e-9
    assert abs(turn) <= DRIVE.max_angular_radps2 * dt_s + 1e-9
    assert abs(wanted.linear_mps - command.linear_mps) <= abs(
        wanted.linear_mps - previous.linear_mps
    )


vectors = st.builds(Velocity2d, st.floats(-0.7, 0.7), st.floats(-1.5, 1.5), st.floats(-0.3, 0.3))


@given(vectors, vectors, st.floats(0.0, 0.2))
def test_a_holonomic_robot_accelerates_no_more_in_any_direction(
    wanted: Velocity2d, previous: Velocity2d, dt_s: float
) -> None:
    command = limit_acceleration(wanted, previous, dt_s, HOLONOMIC)
    ahead = command.linear_mps - previous.linear_mps
    left = command.lateral_mps - previous.lateral_mps
    assert math.hypot(ahead, left) <= HOLONOMIC.max_linear_mps2 * dt_s + 1e-9
    again = limit_acceleration(command, previous, dt_s, HOLONOMIC)
    assert astuple(again) == pytest.approx(astuple(command))
    reached = limit_acceleration(wanted, previous, 10.0, HOLONOMIC)
    assert astuple(reached) == pytest.approx(astuple(wanted))


def driven(
    motion: Drive, pose: Pose2d, seconds: float = 30.0, params: DriveParams = DRIVE
) -> tuple[Pose2d, list[Pose2d]]:
    command, trace = STOP, [pose]
    for _ in range(int(seconds / 0.05)):
        wanted = target_velocity(motion, pose, OPEN, params)
        command = limit_acceleration(wanted, command, 0.05, params)
        pose = moved(pose, command, 0.05)
        trace.append(pose)
    return pose, trace


@pytest.mark.parametrize("params", [DRIVE, HOLONOMIC])
@pytest.mark.parametrize("yaw", [0.0, 1.5, 3.0, -2.0])
def test_it_arrives_and_faces_what_it_should(yaw: float, params: DriveParams) -> None:
    path = np.array([[1.0, 1.0], [3.0, 1.0], [3.0, 3.5]])
    motion = Drive(path, (4.5, 3.5))
    end, trace = driven(motion, Pose2d(1.0, 1.0, yaw), params=params)
    assert arrived(motion, end)
    assert not arrived(motion, trace[0])
    assert end.distance_to((3.0, 3.5)) < 0.15
    assert abs(end.bearing_to((4.5, 3.5))) < 0.15


@pytest.mark.parametrize("params", [DRIVE, HOLONOMIC])
def test_it_stays_near_the_path(params: DriveParams) -> None:
    path = np.array([[1.0, 1.0], [3.0, 1.0], [3.0, 3.5]])
    _, trace = driven(Drive(path, (3.0, 4.5)), Pose2d(1.0, 1.0, 0.0), params=params)
    for pose in trace:
        to_first = abs(pose.y_m - 1.0) if pose.x_m <= 3.0 else 9.0
        to_second = abs(pose.x_m - 3.0) if pose.y_m >= 1.0 else 9.0
        assert min(to_first, to_second) < 0.2


def test_a_holonomic_robot_sets_off_sideways_and_faces_its_goal_sooner() -> None:
    motion = Drive(np.array([[1.0, 1.0], [1.0, 3.0]]), (4.0, 3.0))
    start = Pose2d(1.0, 1.0, 0.0)
    assert target_velocity(motion, start, OPEN, DRIVE).speed_mps == 0.0
    wanted = target_velocity(motion, start, OPEN, HOLONOMIC)
    assert wanted.lateral_mps == pytest.approx(HOLONOMIC.max_lateral_mps)
    assert wanted.angular_radps > 0.0  # it turns to where it drives
    steps = [
        next(
            k
            for k, pose in enumerate(driven(motion, start, params=params)[1])
            if arrived(motion, pose)
        )
        for params in (DRIVE, HOLONOMIC)
    ]
    assert steps[1] < 0.9 * steps[0]


def test_it_slows_down_near_walls_and_before_the_end() -> None:
    narrow = costmap_of(
        drawn_map("#" * 10, "." * 10, "#" * 10, scale=5), (0.75, 0.5), PARAMS.costmap
    )
    motion = Drive(np.array([[0.75, 0.5], [0.75, 4.0]]), (0.75, 5.0))
    pose = Pose2d(0.75, 0.5, math.pi / 2)
    free = target_velocity(motion, pose, OPEN, DRIVE).linear_mps
    assert target_velocity(motion, pose, narrow, DRIVE).linear_mps < 0.7 * free
    assert target_velocity(motion, pose, None, DRIVE).linear_mps < 0.7 * free
    close = Pose2d(0.75, 3.8, math.pi / 2)
    assert target_velocity(motion, close, OPEN, DRIVE).linear_mps < free


@given(poses, st.floats(-math.pi, math.pi), st.floats(0.5, 3.0))
def test_the_tighter_the_arc_the_slower(pose: Pose2d, bearing: float, way_m: float) -> None:
    end = (pose.x_m + way_m * math.cos(bearing), pose.y_m + way_m * math.sin(bearing))
    motion = Drive(np.array([pose.xy, end]), end)
    wanted = target_velocity(motion, pose, OPEN, DRIVE)
    assert wanted.linear_mps >= 0.0
    assert abs(wanted.linear_mps * wanted.angular_radps) <= DRIVE.max_lateral_mps2 + 1e-6
    straight = Pose2d(pose.x_m, pose.y_m, bearing)
    assert wanted.linear_mps <= target_velocity(motion, straight, OPEN, DRIVE).linear_mps + 1e-6
