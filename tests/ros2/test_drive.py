"""What goes to the base: velocities and their end, goals and what they rest on."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from onemap_ros2.drive.driver import (
    MAX_COMMAND_AGE_S,
    MAX_PLAN_AGE_S,
    TURN_RAD,
    GoalPose,
    PlannerInputs,
    RobotNow,
    goal_of,
)
from onemap_ros2.drive.velocity import ZEROS, CommandRelay
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import SearchState, VelocityCommand
from tests.ros2.planner_messages import path_to, status

DRIVE, STOPPED = VelocityCommand(1, 1, 0.3, 0.1, validity_ms=300), Velocity2d()


def sent(relay: CommandRelay, times_s: np.ndarray, *, fresh: bool = True) -> list[Velocity2d]:
    """What goes out at these times without a further command."""
    out = []
    for now_s in times_s:
        relay, velocity = relay.step(float(now_s), None, fresh=fresh)
        out += [velocity] if velocity is not None else []
    return out


def test_a_command_holds_as_long_as_it_is_valid_then_comes_zero_then_silence() -> None:
    relay, velocity = CommandRelay().step(0.0, DRIVE, fresh=True)
    assert velocity == Velocity2d(0.3, 0.1)
    assert sent(relay, np.arange(0.0, 0.3, 0.02)) == []
    assert sent(relay, np.arange(0.31, 5.0, 0.02)) == [STOPPED] * (1 + ZEROS)


def test_stale_odometry_stops_at_once_and_refuses_commands() -> None:
    relay, _ = CommandRelay().step(0.0, DRIVE, fresh=True)
    relay, velocity = relay.step(0.05, DRIVE, fresh=False)
    assert velocity == STOPPED
    for now_s in np.arange(1.0, 2.0, 0.05):
        relay, velocity = relay.step(float(now_s), DRIVE, fresh=False)
        assert velocity in (STOPPED, None)
    # Without any command, another publisher of cmd_vel, such as a joystick, is not disturbed.
    assert sent(CommandRelay(), np.arange(0.0, 5.0, 0.05), fresh=False) == []


ORIGIN = GoalPose(0.0, 0.0, 0.0)


def test_the_goal_is_the_end_of_the_path_and_faces_what_is_looked_at() -> None:
    goal = goal_of(path_to(2.0, 0.0, look=(2.0, 5.0)), ORIGIN)
    assert goal is not None
    assert (goal.x_m, goal.y_m, goal.yaw_rad) == pytest.approx((2.0, 0.0, math.pi / 2))
    turned = goal_of(path_to(3.0, 0.0, "rotate"), GoalPose(1.0, 2.0, 3.0))
    assert turned is not None  # to the left in place
    assert (turned.x_m, turned.y_m, turned.turns) == (1.0, 2.0, True)
    assert turned.yaw_rad == pytest.approx(3.0 + TURN_RAD - 2 * math.pi)
    for motion in ("rest", "reverse", ""):
        assert goal_of(path_to(3.0, 0.0, motion), ORIGIN) is None


NOW = RobotNow(10.1, 7, True, ORIGIN)
COMMAND = replace(DRIVE, frame_ns=1)
PLANNED = PlannerInputs().with_status(status("s1")).with_path(path_to(2.0, 0.0), 10.0)
INPUTS = PLANNED.with_command(COMMAND, 10.0, fresh=True)


def test_a_goal_needs_a_search_a_recent_plan_a_recent_command_and_fresh_odometry() -> None:
    assert INPUTS.goal(NOW) == GoalPose(2.0, 0.0, 0.0)
    late = replace(NOW, now_s=10.0 + MAX_PLAN_AGE_S + 0.01)
    ended = [
        INPUTS.with_status(status("s1", state)).goal(NOW)
        for state in (SearchState.CANCELLED, SearchState.FOUND, SearchState.FAILED)
    ]
    assert [
        *ended,
        replace(INPUTS, search="").goal(NOW),
        replace(INPUTS, path=None).goal(NOW),
        PLANNED.goal(NOW),
        PLANNED.with_command(COMMAND, 10.0, fresh=False).goal(NOW),
        INPUTS.with_command(DRIVE, 10.1, fresh=True).goal(NOW),
        INPUTS.with_places(INPUTS.places_version + 1).goal(NOW),
        INPUTS.goal(replace(NOW, now_s=10.0 + MAX_COMMAND_AGE_S + 0.01)),
        INPUTS.with_command(COMMAND, late.now_s, fresh=True).goal(late),
        INPUTS.goal(replace(NOW, fresh=False)),
        INPUTS.goal(replace(NOW, pose=None)),
    ] == [None] * 13


def test_one_step_of_rest_ends_no_goal() -> None:
    rest, inputs = path_to(0.0, 0.0, "rest"), INPUTS.with_path(path_to(2.0, 0.0), 10.0)
    resting = inputs.with_path(rest, 10.25)
    assert resting.goal(NOW) == GoalPose(2.0, 0.0, 0.0)
    assert resting.with_path(rest, 10.5).goal(NOW) is None
