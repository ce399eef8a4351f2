"""A driver's thread drives as commanded, and stops when nothing commands it any more."""

from __future__ import annotations

import threading
from queue import SimpleQueue

import numpy as np
import pytest

from onemap_shared import keys
from onemap_shared.clock import SystemClock
from onemap_shared.command_follower import CommandFollower
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import Odometry, VelocityCommand
from tests.memory_bus import MemoryRouter

PATIENCE_S = 60.0
STOP = Velocity2d()


class Base:
    """What was sent to the robot's base; fails at the speed ``broken_mps``."""

    def __init__(self, broken_mps: float = 9.0) -> None:
        self.sent: SimpleQueue[Velocity2d] = SimpleQueue()
        self._broken_mps = broken_mps

    def drive(self, velocity: Velocity2d) -> None:
        if velocity.linear_mps == self._broken_mps:
            raise OSError("the base is gone")
        self.sent.put(velocity)

    def until(self, velocity: Velocity2d) -> None:
        while self.sent.get(timeout=PATIENCE_S) != velocity:
            pass


class At7ns(SystemClock):
    def wall_ns(self) -> int:
        return 7


def test_it_drives_and_stops_when_the_last_command_has_run_out() -> None:
    router, base = MemoryRouter(At7ns()), Base()
    robot = router.bus("robot")
    follower = CommandFollower(robot, base.drive)
    commands = router.bus("planner").publish(keys.ROBOT_CMD_VEL)
    base.until(STOP)  # also before the first command
    commands.put(VelocityCommand(1, 5, 0.5, 0.25, planner="p", driver=robot.instance))
    base.until(Velocity2d(0.5, 0.25))
    named = follower.named(Odometry(0, 0, np.eye(4), 0.0, 0.0))
    assert named.driver == robot.instance
    assert (named.planner, named.command_sequence) in (("p", 1), ("", 0))  # until it lets go
    base.until(STOP)
    commands.put(VelocityCommand(2, 5, 0.5, 0.0, planner="p", driver="the one before"))
    commands.put(VelocityCommand(3, 5, 0.25, 0.0, planner="p", odometry_stamp_ns=7))
    base.until(Velocity2d(0.25, 0.0))
    follower.close()
    while not base.sent.empty():
        last = base.sent.get()
    assert last == STOP


def test_a_base_that_fails_is_stopped_and_told(caplog: pytest.LogCaptureFixture) -> None:
    router, base = MemoryRouter(), Base(broken_mps=0.5)
    follower = CommandFollower(router.bus("robot"), base.drive)
    commands = router.bus("planner").publish(keys.ROBOT_CMD_VEL)
    base.until(STOP)
    while not base.sent.empty():
        base.sent.get()
    commands.put(VelocityCommand(1, 5, 0.5, 0.0))
    base.until(STOP)
    while not follower.problem:
        pass
    assert follower.problem.startswith("the base refuses velocities")
    assert "the base cannot be driven" in caplog.text
    follower.close()


def test_a_base_that_does_not_answer_is_told() -> None:
    answers = threading.Event()

    def drive(_: Velocity2d) -> None:
        answers.wait()

    follower = CommandFollower(MemoryRouter().bus("robot"), drive)
    while not follower.problem:
        pass
    assert "has not answered for 0.3 s: it must brake by itself" in follower.problem
    answers.set()
    while follower.problem:
        pass
    follower.close()
