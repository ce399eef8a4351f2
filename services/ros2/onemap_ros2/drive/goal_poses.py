"""Publishes the planner's goals as messages, for what drives to them without an action."""

from __future__ import annotations

from onemap_ros2.cdr import POSE_STAMPED
from onemap_ros2.config import Ros2Config
from onemap_ros2.drive.driver import (
    ARRIVED_M,
    ARRIVED_RAD,
    GOAL_CHANGE_M,
    GOAL_CHANGE_RAD,
    GOAL_PERIOD_S,
    NEVER,
    GoalPose,
    GoalReport,
    PlannerVoice,
    RobotNow,
    Say,
    encoded_pose,
)
from onemap_ros2.network.interface import RosNetwork
from onemap_ros2.topic_list import missing
from onemap_shared.messages import VelocityCommand

STILL_S = 2.0  # of standing: twice what nav2 takes to plan


class GoalPoseDriver:
    """Implements ``Driver``. To stop, the robot gets where it stands as its goal."""

    def __init__(self, network: RosNetwork, config: Ros2Config, say: Say) -> None:
        del say
        self._network, self._config = network, config
        self._writer = network.write(config.names.goal_pose, POSE_STAMPED)
        self._goal: GoalPose | None = None
        self._robot: RobotNow | None = None
        self._sent_s = self._moved_s = self._stop_until_s = NEVER
        self._sent = 0

    def step(self, robot: RobotNow, command: VelocityCommand | None, voice: PlannerVoice) -> None:
        """See ``Driver``; a velocity counts as the planner's sign of life only."""
        del command
        self._robot = robot
        self._moved_s = robot.now_s if robot.moving else self._moved_s
        wanted = voice.goal(robot)
        due = robot.now_s - self._sent_s >= GOAL_PERIOD_S
        if wanted is None:
            self._stop(robot, due=due)
        elif due and self._is_new(wanted, robot.pose):
            self._goal = wanted
            self._put(wanted, robot)

    def problem(self) -> str:
        """See ``Driver``."""
        return missing(self._network.endpoints(), self._config).get("goal_pose", "")

    def report(self) -> GoalReport:
        """See ``Driver``: nobody says when a goal is reached, but near it the robot stands."""
        goal, robot = self._goal, self._robot
        if goal is None or robot is None or robot.pose is None or robot.pose.differs(goal):
            return GoalReport()
        stands_s = robot.now_s - max(self._moved_s, self._sent_s)
        return GoalReport(goal if stands_s >= STILL_S else None)

    @property
    def idle(self) -> bool:
        """See ``Driver``."""
        return self._goal is None

    def metrics(self) -> dict[str, float]:
        """See ``Driver``."""
        return {"goals_sent": float(self._sent)}

    def close(self) -> None:
        """See ``Driver``."""
        if self._goal is not None and self._robot is not None and self._robot.pose is not None:
            self._put(self._robot.pose, self._robot)

    def _is_new(self, wanted: GoalPose, here: GoalPose | None) -> bool:
        """Whether it is another goal; another turn, once the robot has almost done this one."""
        stands = self.report().reached is not None
        limits = (ARRIVED_M, ARRIVED_RAD) if stands else (GOAL_CHANGE_M, GOAL_CHANGE_RAD)
        if self._goal is None or wanted.differs(self._goal, *limits):
            return True
        return wanted.turns and here is not None and not here.differs(self._goal)

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
