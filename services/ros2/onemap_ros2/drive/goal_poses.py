"""Publishes the planner's goals as messages, for what drives to them without an action."""

from __future__ import annotations

from onemap_ros2.cdr import POSE_STAMPED
from onemap_ros2.config import Ros2Config
from onemap_ros2.drive.driver import (
    GOAL_PERIOD_S,
    NEVER,
    GoalPose,
    PlannerVoice,
    RobotNow,
    Say,
    encoded_pose,
)
from onemap_ros2.network.interface import RosNetwork
from onemap_ros2.topic_list import missing
from onemap_shared.messages import VelocityCommand


class GoalPoseDriver:
    """Implements ``Driver``. To stop, the robot gets where it stands as its goal."""

    def __init__(self, network: RosNetwork, config: Ros2Config, say: Say) -> None:
        del say
        self._network, self._config = network, config
        self._writer = network.write(config.names.goal_pose, POSE_STAMPED)
        self._goal: GoalPose | None = None
        self._robot: RobotNow | None = None
        self._sent_s = self._stop_until_s = NEVER
        self._sent = 0

    def step(self, robot: RobotNow, command: VelocityCommand | None, voice: PlannerVoice) -> None:
        """See ``Driver``; a velocity counts as the planner's sign of life only."""
        del command
        self._robot = robot
        wanted = voice.goal(robot)
        due = robot.now_s - self._sent_s >= GOAL_PERIOD_S
        if wanted is None:
            self._stop(robot, due=due)
        elif due and (self._goal is None or wanted.differs(self._goal)):
            self._goal = wanted
            self._put(wanted, robot)

    def problem(self) -> str:
        """See ``Driver``."""
        return missing(self._network.endpoints(), self._config).get("goal_pose", "")

    def metrics(self) -> dict[str, float]:
        """See ``Driver``."""
        return {"goals_sent": float(self._sent)}

    def close(self) -> None:
        """See ``Driver``."""
        if self._goal is not None and self._robot is not None and self._robot.pose is not None:
            self._put(self._robot.pose, self._robot)

    def _stop(self, robot: RobotNow, *, due: bool) -> None:
        """Send the robot to where it stands, twice at most in case a message is lost."""
        if self._goal is not None:
            self._goal = None
            self._stop_until_s = robot.now_s + 2 * GOAL_PERIOD_S
        elif not due or robot.now_s > self._stop_until_s:
            return
        if robot.pose is not None:
            self._put(robot.pose, robot)

    def _put(self, goal: GoalPose, robot: RobotNow) -> None:
        self._sent_s = robot.now_s
        self._sent += 1
        self._writer.put(encoded_pose(goal, robot.stamp_ns, self._config.map_frame))
