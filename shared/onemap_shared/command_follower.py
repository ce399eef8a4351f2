"""Drives a robot as commanded, in a thread of its own; brakes when the last command has run out.

For a driver written in Python, such as ``examples/my_robot.py``: whatever its camera, its
localisation and its bus do, this thread waits for none of them.
"""
# Talks: the thread that drives.

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace

from onemap_shared import keys
from onemap_shared.command_gate import MAX_VALIDITY_S, CommandGate, Deadman
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import Odometry
from onemap_shared.transport import Bus

LOG = logging.getLogger("onemap.robot")

PERIOD_S = 0.05  # between two stops, and the longest wait: as often as commands come
CLOSE_S = 1.0  # for which the end waits for a base that does not answer


class CommandFollower:
    """Sends each velocity that the robot may follow to ``drive``, and stops without one.

    drive: sends a velocity to the base. It must return at once: while it waits, nothing can brake
    but the base itself. If it raises, the robot is told to stop, and nothing is followed any more.
    """

    def __init__(self, bus: Bus, drive: Callable[[Velocity2d], None]) -> None:
        self._drive, self._clock = drive, bus.clock
        self._commands = bus.subscribe(keys.ROBOT_CMD_VEL)
        self._gate, self._deadman = CommandGate(bus.instance), Deadman()
        self._closed, self._failed = bus.clock.event(), bus.clock.event()
        self._calls_s = float("inf")  # since when the base has not answered a velocity
        self._thread = bus.clock.thread("follow-commands", self._run)

    def named(self, odometry: Odometry) -> Odometry:
        """The odometry with this driver, the planner that is followed, and its newest command."""
        planner, sequence = self._gate.echo(self._clock.monotonic_s())
        return replace(
            odometry, driver=self._gate.driver, planner=planner, command_sequence=sequence
        )

    @property
    def problem(self) -> str:
        """Why the base cannot be driven, for who ends the program then; empty if it can."""
        if self._failed.is_set():
            return "the base refuses velocities: see the log"
        if self._clock.monotonic_s() - self._calls_s > MAX_VALIDITY_S:
            return f"the base has not answered for {MAX_VALIDITY_S:g} s: it must brake by itself"
        return ""

    def close(self) -> None:
        """Stop the robot, and follow nothing any more."""
        self._closed.set()
        self._thread.join(CLOSE_S)

    def _run(self) -> None:
        try:
            while not self._closed.is_set():
                self._follow()
        except Exception:
            LOG.exception("the base cannot be driven: the robot is stopped")
            self._failed.set()
        finally:
            self._send(Velocity2d())

    def _send(self, velocity: Velocity2d) -> None:
        self._calls_s = self._clock.monotonic_s()
        self._drive(velocity)
        self._calls_s = float("inf")

    def _follow(self) -> None:
        """Wait for a command, no longer than until the last one runs out; drive, or stop."""
        left_s = self._deadman.expires_s - self._clock.monotonic_s()
        command = self._commands.take(left_s if 0.0 < left_s < PERIOD_S else PERIOD_S)
        now_s = self._clock.monotonic_s()
        if command is not None:  # only of one planner, for this driver, on fresh odometry
            self._gate, command = self._gate.receive(command, now_s, self._clock.wall_ns())
        if command is not None:
            validity_s = command.validity_ms * 1e-3
            self._deadman = self._deadman.with_command(command.velocity, now_s, validity_s)
        if command is not None or not self._deadman.holds(now_s):
            self._send(self._deadman.command_at(now_s))
