"""The loop is measured on one clock; where the robot names no command, delays are compared."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.staleness import (
    FRESH_S,
    SET_BACK_S,
    WINDOW_S,
    LoopMonitor,
    OdometryDelay,
    SentCommand,
)
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import Odometry

LIMIT_S = 0.6
HERE = Pose2d(1.0, 2.0, 0.0)


def odometry(named: int, planner: str = "p") -> Odometry:
    return Odometry(1, 1, np.eye(4), 0.0, 0.0, planner=planner, command_sequence=named)


def sent(
    monitor: LoopMonitor, *commands: tuple[int, float], velocity: Velocity2d | None = None
) -> LoopMonitor:
    for sequence, at_s in commands:
        monitor = monitor.with_sent(SentCommand(sequence, at_s, velocity or Velocity2d()))
    return monitor


def test_the_loop_is_from_sending_to_the_odometry_that_names_the_command() -> None:
    monitor = sent(LoopMonitor("p"), (1, 10.0), (2, 10.05), (3, 10.1))
    assert monitor.confirmed(10.1)  # nothing says yet that this robot names commands
    heard = monitor.with_odometry(odometry(0, ""), 10.1)
    assert not heard.confirmed(10.1)
    assert heard.loop_s(10.15) == pytest.approx(0.15)  # that long it waits already
    named = heard.with_odometry(odometry(2), 10.2)
    assert named.confirmed(10.2)
    assert named.loop_s(10.2) == pytest.approx(0.15)
    assert named.loop_s(10.5) == pytest.approx(0.4)  # the third is not named
    assert named.with_odometry(odometry(2), 10.6).measured_at_s == 10.2  # named again


@settings(max_examples=30)
@given(delay_s=st.floats(0.0, 3.0), period_s=st.floats(0.02, 0.2))
def test_a_constant_delay_is_what_is_measured(delay_s: float, period_s: float) -> None:
    monitor = LoopMonitor("p")
    arrivals: list[tuple[float, int]] = []
    for k in range(1, 60):
        now_s = k * period_s
        while arrivals and arrivals[0][0] <= now_s:
            at_s, sequence = arrivals.pop(0)
            monitor = monitor.with_odometry(odometry(sequence), at_s)
        monitor = sent(monitor, (k, now_s))
        arrivals.append((now_s + delay_s, k))
    if monitor.named:
        assert monitor.loop_s(now_s) == pytest.approx(delay_s, abs=period_s + 1e-9)
        assert monitor.problem(now_s, delay_s + 2 * period_s) == ""
        assert monitor.problem(now_s, delay_s - 2 * period_s) != ""


def test_what_was_measured_long_ago_says_nothing() -> None:
    monitor = sent(LoopMonitor("p"), (1, 10.0)).with_odometry(odometry(1), 10.1)
    assert monitor.confirmed(10.1 + FRESH_S)
    assert not monitor.confirmed(10.2 + FRESH_S)
    assert monitor.loop_s(10.2 + FRESH_S) == 0.0
    later = sent(monitor, (2, 20.0), (3, 90.0))  # the second was never named
    assert later.problem(90.1, LIMIT_S) == ""
    assert not later.confirmed(90.1)


@pytest.mark.parametrize("named", [-2, -1, 0, 7, 2**40])
def test_a_command_that_was_never_sent_confirms_nothing(named: int) -> None:
    monitor = sent(LoopMonitor("p"), (1, 10.0)).with_odometry(odometry(named), 10.1)
    assert math.isnan(monitor.measured_s)
    assert monitor.confirmed(10.1) == (named < 0)


def test_another_planner_s_robot_is_named_as_the_reason() -> None:
    monitor = sent(LoopMonitor("p"), (1, 10.0), (2, 10.5)).with_odometry(odometry(1, "q"), 10.6)
    assert monitor.problem(10.6, LIMIT_S) == ""
    assert not monitor.confirmed(10.6)
    assert monitor.problem(10.7, LIMIT_S) == "the robot follows another planner, instance q"
    nobody = monitor.with_odometry(odometry(0, ""), 10.7)
    assert nobody.problem(10.7, LIMIT_S) == (
        "waiting for the robot: a command takes longer than 0.6 s there and back"
    )


def test_the_pose_is_carried_on_by_the_commands_under_way() -> None:
    ahead = Velocity2d(0.5, 0.0)
    monitor = sent(LoopMonitor("p"), *((k, 10.0 + k / 20) for k in range(9)), velocity=ahead)
    assert monitor.predicted(HERE, 10.45, 0.1) == HERE  # of a robot that names none
    named = monitor.with_odometry(odometry(0), 10.45)
    assert named.predicted(HERE, 10.45, 1.0) == HERE
    assert named.predicted(HERE, 10.45, 0.101).x_m == pytest.approx(1.0 + 0.5 * 0.3)
    assert named.predicted(HERE, 10.45, 0.0).x_m == pytest.approx(1.0 + 0.5 * 0.4)
    turning = sent(LoopMonitor("p"), (1, 10.0), (2, 10.2), velocity=Velocity2d(0.0, 1.0))
    turned = turning.with_odometry(odometry(1), 10.3).predicted(HERE, 10.3, 0.0)
    assert turned.yaw_rad == pytest.approx(0.1)
    assert LoopMonitor("p").with_odometry(odometry(1), 10.3).predicted(HERE, 10.3, 0.0) == HERE


def delays(*each: tuple[float, float], clock_s: float = 1.7e9) -> OdometryDelay:
    """After odometry that arrived at these times, so many seconds after its stamp."""
    delay = OdometryDelay()
    for now_s, delay_s in each:
        delay = delay.with_odometry(int((clock_s + now_s - delay_s) * 1e9), now_s)
    return delay


def test_a_delay_counts_from_the_least_that_was_seen_lately() -> None:
    assert OdometryDelay().excess_s == 0.0
    grown = delays((10.0, 0.3), (10.1, 0.1), (10.6, 0.5))
    assert grown.excess_s == pytest.approx(0.4, abs=1e-5)
    assert grown.problem(0.3) == "waiting for the robot's position: 0.4 s behind"
    assert grown.problem(0.5) == ""
    steady = [(10.6 + k, 0.5) for k in range(int(3 * WINDOW_S))]
    assert delays((10.0, 0.1), *steady[: int(WINDOW_S)]).excess_s == pytest.approx(0.4, abs=1e-5)
    assert delays((10.0, 0.1), *steady).excess_s == pytest.approx(0.0, abs=1e-5)


@given(step_s=st.floats(0.11, 1e4))
def test_no_delay_is_too_long_to_count(step_s: float) -> None:
    late = delays((10.0, 0.1), (10.1 + step_s, 0.1 + step_s))  # the link held it back
    assert late.excess_s == pytest.approx(step_s, abs=1e-5)
    set_back = delays((10.0, 0.1), (10.1, 0.2 + SET_BACK_S + step_s))
    assert set_back.excess_s == 0.0


def test_stamps_that_go_back_a_little_and_again_do_not_hide_a_delay() -> None:
    late = delays((10.0, 0.1), *((10.0 + k / 20, 1.0 + k % 2 / 5) for k in range(20, 40)))
    assert late.excess_s > 0.8
