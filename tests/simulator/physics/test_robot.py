from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_shared.geometry import Velocity2d
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.robot import (
    STOP,
    Deadman,
    RobotParams,
    RobotState,
    step,
)
from tests.simulator.scenes import box_room

PARAMETERS = RobotParams()
HOLONOMIC = RobotParams(max_lateral_mps=0.4)
START = RobotState(1.0, 1.0, 0.0)
COMMANDS = st.builds(Velocity2d, st.floats(-2, 2), st.floats(-4, 4), st.floats(-2, 2))


def nowhere(x: float, y: float) -> bool:
    return False


def drive(
    state: RobotState,
    command: Velocity2d,
    seconds: float,
    dt_s: float = 0.02,
    params: RobotParams = PARAMETERS,
) -> RobotState:
    for _ in range(round(seconds / dt_s)):
        state = step(state, command, dt_s, params=params, collides=nowhere)
    return state


def test_reaches_the_commanded_speed_with_the_acceleration_limit() -> None:
    assert drive(START, Velocity2d(0.5), 0.3).velocity.linear_mps == pytest.approx(0.3)
    assert drive(START, Velocity2d(0.5), 1.0).velocity.linear_mps == pytest.approx(0.5)
    # Half a second of acceleration, then half a second at 0.5 m/s.
    assert drive(START, Velocity2d(0.5), 1.0).x_m == pytest.approx(1.0 + 0.125 + 0.25)


def test_is_limited_in_speed() -> None:
    fast = drive(START, Velocity2d(9.0, -9.0), 3.0)
    assert fast.velocity == Velocity2d(0.7, -1.6)


def test_drives_a_circle_back_to_where_it_began() -> None:
    rolling = replace(START, velocity=Velocity2d(0.4, 0.5))
    once = step(rolling, rolling.velocity, 4 * np.pi, params=PARAMETERS, collides=nowhere)
    assert (once.x_m, once.y_m, once.yaw_rad) == pytest.approx((1.0, 1.0, 0.0), abs=1e-9)
    half = drive(rolling, rolling.velocity, 2 * np.pi, dt_s=2 * np.pi / 300)
    assert (half.x_m, half.y_m) == pytest.approx((1.0, 1.0 + 2 * 0.4 / 0.5), abs=1e-9)


def test_a_differential_drive_ignores_what_is_sideways() -> None:
    assert drive(START, Velocity2d(0.4, 0.2, 0.3), 2.0) == drive(START, Velocity2d(0.4, 0.2), 2.0)


def test_a_holonomic_drive_moves_sideways_within_its_limits() -> None:
    left = drive(replace(START, yaw_rad=np.pi / 2), Velocity2d(0, 0, 9.0), 2.0, params=HOLONOMIC)
    assert left.velocity.lateral_mps == pytest.approx(0.4)
    assert left.x_m == pytest.approx(1.0 - 0.4 * 2.0 + 0.4**2 / 2)  # 1 m/s^2 up to the limit
    assert left.y_m == pytest.approx(1.0)


@given(st.floats(-0.7, 0.7), st.floats(-1.6, 1.6), st.floats(-0.4, 0.4))
def test_an_arc_is_that_of_many_small_steps(linear: float, angular: float, lateral: float) -> None:
    rolling = replace(START, velocity=Velocity2d(linear, angular, lateral))
    once = step(rolling, rolling.velocity, 1.0, params=HOLONOMIC, collides=nowhere)
    x, y, count = 1.0, 1.0, 2000
    for k in range(count):  # Euler's way, with the heading in the middle of each step
        yaw = angular * (k + 0.5) / count
        x += (linear * np.cos(yaw) - lateral * np.sin(yaw)) / count
        y += (linear * np.sin(yaw) + lateral * np.cos(yaw)) / count
    assert (once.x_m, once.y_m) == pytest.approx((x, y), abs=1e-6)


def test_turning_left_is_positive() -> None:
    assert drive(START, Velocity2d(0.0, 1.0), 1.0).yaw_rad > 0
    assert drive(START, Velocity2d(0.3, 1.0), 1.0).y_m > START.y_m


@settings(max_examples=60, deadline=None, derandomize=True)
@given(commands=st.lists(COMMANDS, max_size=30), seed=st.integers(0, 99))
def test_is_never_inside_an_obstacle(commands: list[Velocity2d], seed: int) -> None:
    collision = CollisionMap.of(box_room(), PARAMETERS.height_m)

    def collides(x: float, y: float) -> bool:
        return collision.clearance_m(x, y) < PARAMETERS.radius_m

    state = replace(START, yaw_rad=float(np.random.default_rng(seed).uniform(-np.pi, np.pi)))
    for command in commands:
        for _ in range(25):
            before = state
            state = step(state, command, 0.02, params=HOLONOMIC, collides=collides)
            assert not collides(state.x_m, state.y_m)
            change = abs(state.velocity.linear_mps - before.velocity.linear_mps)
            assert change <= 0.02 + 1e-9 or state.collided


def test_a_collision_stops_and_reports_and_can_be_left_again() -> None:
    def collides(x: float, y: float) -> bool:
        return x > 1.5

    state, collided = START, False
    for _ in range(200):
        state = step(state, Velocity2d(0.7), 0.02, params=PARAMETERS, collides=collides)
        collided = collided or state.collided
    assert collided
    assert 1.47 < state.x_m <= 1.5
    for _ in range(50):
        state = step(state, Velocity2d(-0.5), 0.02, params=PARAMETERS, collides=collides)
    assert not state.collided
    assert state.x_m < 1.3


def test_deadman_holds_a_command_for_its_validity_and_then_brakes() -> None:
    deadman = Deadman(timeout_s=0.3)
    assert deadman.command_at(0.0) == STOP
    moving = deadman.with_command(Velocity2d(0.5), now_s=10.0, validity_s=5.0)
    assert moving.command_at(10.29) == Velocity2d(0.5)
    assert moving.command_at(10.3) == STOP
    assert deadman.with_command(Velocity2d(0.5), 10.0, validity_s=0.1).command_at(10.15) == STOP
    assert moving.expired_between(10.29, 10.31)
    assert not moving.expired_between(10.31, 10.33)
    assert not deadman.with_command(STOP, 10.0, 0.3).expired_between(10.29, 10.31)


def test_braking_obeys_the_acceleration_limit() -> None:
    rolling = replace(START, velocity=Velocity2d(0.7))
    stopped = drive(rolling, STOP, 0.7)
    assert stopped.velocity.linear_mps == pytest.approx(0.0, abs=1e-9)
    assert stopped.x_m - 1.0 == pytest.approx(0.7**2 / 2, rel=1e-6)
