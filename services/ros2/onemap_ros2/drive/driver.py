"""What the adapter needs of whatever moves the robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from onemap_ros2.drive.goal_pose import GoalPose
from onemap_ros2.drive.planner_voice import PlannerVoice
from onemap_shared.messages import VelocityCommand


@dataclass(frozen=True, slots=True)
class RobotNow:
    """The robot at one moment.

    Attributes:
        now_s: seconds of a monotonic clock.
        stamp_ns: the same on the robot's clock, which may be simulated.
        fresh: whether its odometry is.
        pose: of its body on the map; None before the first odometry.
    """

    now_s: float
    stamp_ns: int
    fresh: bool
    pose: GoalPose | None


class Driver(Protocol):
    """Moves the robot, and stops it."""

    def step(self, robot: RobotNow, command: VelocityCommand | None, voice: PlannerVoice) -> None:
        """Send what is to be sent now; ``command``: a velocity that the planner sent just now."""

    def problem(self) -> str:
        """Why the robot cannot be driven, in one sentence; empty if it can."""

    def take_news(self) -> list[str]:
        """What happened since the last call, a sentence each, for the log."""

    def metrics(self) -> dict[str, float]:
        """Counts for health."""

    def close(self) -> None:
        """Stop the robot."""
