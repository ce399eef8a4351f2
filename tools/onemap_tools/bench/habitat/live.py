"""Habitat's robot in real time: when it publishes what. Time is an argument."""

from __future__ import annotations

from onemap_shared.messages import VelocityCommand
from onemap_tools.bench.habitat.robot import HabitatRobot

PERIOD_S = 0.02  # longest wait for a command: it is obeyed that soon
ODOMETRY_HZ, RGBD_HZ = 20.0, 8.0  # as the simulator's robot


class LiveHabitatRobot:
    """Drives, and publishes odometry and frames at their rates; what was missed is skipped."""

    def __init__(self, robot: HabitatRobot, now_s: float) -> None:
        self._robot = robot
        self._odometry_due_s = self._frame_due_s = now_s

    def step(self, command: VelocityCommand | None, now_s: float, stamp_ns: int) -> None:
        """Drive up to ``now_s``, follow a command from then on, publish what is due.

        stamp_ns: the wall clock's, of what is published.
        """
        self._robot.advance(now_s)
        self._robot.obey(command, now_s, stamp_ns)
        if now_s >= self._odometry_due_s:
            self._odometry_due_s = following(self._odometry_due_s, 1 / ODOMETRY_HZ, now_s)
            self._robot.publish_odometry(stamp_ns)
        if now_s >= self._frame_due_s:
            self._frame_due_s = following(self._frame_due_s, 1 / RGBD_HZ, now_s)
            self._robot.publish_frame(stamp_ns)


def following(due_s: float, period_s: float, now_s: float) -> float:
    """The next time of a periodic task; periods missed in a stall are skipped."""
    due_s += period_s
    return due_s if due_s > now_s else now_s + period_s
