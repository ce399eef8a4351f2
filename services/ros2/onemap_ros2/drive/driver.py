"""What moves the robot, and on what it rests: the planner's last words, and the goal in them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol, TypeAlias

import numpy as np

from onemap_ros2.cdr import POSE_STAMPED, header, new, pose
from onemap_shared.geometry import F64, wrap_angle, yaw_of
from onemap_shared.messages import PlannedPath, SearchStatus, VelocityCommand

NEAR_M = 0.05  # a direction over less than this is noise
# Of a goal that makes the robot rotate where it stands: three are a circle, though nav2 ends each
# 0.25 rad before, and left is the shorter way.
TURN_RAD = 2.4
# By so much the planner's goal must move, or its heading turn, before the robot's is replaced: each
# one makes nav2 plan anew, and ends of paths move by a few cells at each plan. A third of a view.
GOAL_CHANGE_M, GOAL_CHANGE_RAD = 0.4, 0.6
# The same once the robot has reached its goal: the planner's own tolerances.
ARRIVED_M, ARRIVED_RAD = 0.12, 0.15
REST_S = 0.4  # one step of the planner, which takes 0.25 s, and not two
NEVER = float("-inf")
Log: TypeAlias = Callable[[str], None]  # what happened, for the log
GOAL_PERIOD_S = 1.0  # least time between two goals: nav2's behaviour tree plans once a second
# After so long without a plan, or a velocity, the goal ends: the planner plans four times a second,
# not while its inputs are too old, and a velocity holds for half of that time.
MAX_PLAN_AGE_S, MAX_COMMAND_AGE_S = 1.5, 0.6


@dataclass(frozen=True, slots=True)
class GoalPose:
    """A pose on the floor, in the map frame; turns: it makes the robot look around in place."""

    x_m: float
    y_m: float
    yaw_rad: float
    turns: bool = False

    def away_m(self, other: GoalPose) -> float:
        """Metres between both."""
        return math.hypot(self.x_m - other.x_m, self.y_m - other.y_m)

    def differs(
        self, other: GoalPose, by_m: float = GOAL_CHANGE_M, by_rad: float = GOAL_CHANGE_RAD
    ) -> bool:
        """Whether the other one is further away, or turned by more, than goals may be.

        All turns in one place are one: the next is due when the robot has turned.
        """
        turned = abs(wrap_angle(self.yaw_rad - other.yaw_rad)) > by_rad
        return self.away_m(other) > by_m or (turned and not (self.turns and other.turns))


def pose_of(T_map_body: F64) -> GoalPose:
    """The pose of the robot's body (4, 4) on the floor."""
    return GoalPose(float(T_map_body[0, 3]), float(T_map_body[1, 3]), yaw_of(T_map_body))


def goal_of(path: PlannedPath, robot: GoalPose) -> GoalPose | None:
    """The goal of a plan, from where the robot stands; None if it is not to move or to reverse.

    To rotate is a goal in place, further to the left than the robot is.
    """
    if path.motion == "rotate":
        return GoalPose(robot.x_m, robot.y_m, wrap_angle(robot.yaw_rad + TURN_RAD), turns=True)
    if path.motion != "drive" or len(path.points_m) == 0:
        return None
    x_m, y_m = (float(value) for value in path.points_m[-1])
    return GoalPose(x_m, y_m, _heading_rad(path, robot))


def _heading_rad(path: PlannedPath, robot: GoalPose) -> float:
    """Towards what the robot shall face; else along the end of the path; else as it stands."""
    end = path.points_m[-1]
    starts = (robot.x_m, robot.y_m), *path.points_m[:-1]
    directions = [np.asarray(path.look_m) - end] if path.look_m else []
    directions += [end - np.asarray(start) for start in reversed(starts)]
    for dx, dy in directions:
        if math.hypot(dx, dy) > NEAR_M:
            return math.atan2(float(dy), float(dx))
    return robot.yaw_rad


def stamped_pose(goal: GoalPose, stamp_ns: int, frame: str) -> object:
    """The goal as ``geometry_msgs/PoseStamped``."""
    at = pose(goal.x_m, goal.y_m, yaw_rad=goal.yaw_rad)
    return new(POSE_STAMPED, header(stamp_ns, frame), at)


@dataclass(frozen=True, slots=True)
class PlannerInputs:
    """The planner's newest messages, with their times of arrival in seconds.

    path: of this search, and made with the newest places; None before the first. command_s: of the
    newest velocity that says that the planner may move the robot. search: the id of the active one,
    empty without. places_version: of the newest places of the map.
    """

    path: PlannedPath | None = None
    path_s: float = NEVER
    command_s: float = NEVER
    search: str = ""
    places_version: int = 0

    def with_places(self, version: int) -> PlannerInputs:
        """After the version of the places came: a plan does not know the zones of another one."""
        if version == self.places_version:
            return self
        return replace(self, places_version=version, path=None, path_s=NEVER)

    def with_path(self, path: PlannedPath, now_s: float) -> PlannerInputs:
        """After a plan came; one to rest counts from the second on.

        The planner rests for a step when it changes its mind, and mostly drives on to the same.
        """
        drives = self.path is not None and self.path.motion in ("drive", "rotate")
        if path.motion == "rest" and drives and now_s - self.path_s <= REST_S:
            return self
        return replace(self, path=path, path_s=now_s)

    def with_status(self, status: SearchStatus) -> PlannerInputs:
        """After the state of the search came; the plan of another search counts no more."""
        search = status.search_id if status.active else ""
        if search == self.search:
            return self
        return replace(self, search=search, path=None, path_s=NEVER)

    def with_command(self, command: VelocityCommand, now_s: float, *, fresh: bool) -> PlannerInputs:
        """After a velocity came; ``fresh``: it was made on what the robot sent just now.

        One that rests on no frame is the planner's stop on stale inputs: it ends the goal at once.
        A late one says nothing about now.
        """
        if command.frame_ns == 0:
            return replace(self, command_s=NEVER)
        return replace(self, command_s=now_s) if fresh else self

    def goal(self, robot: RobotNow) -> GoalPose | None:
        """Where the robot is to drive; None: it must not drive on.

        It must not without fresh odometry, an active search, a recent plan and a recent velocity:
        the planner sends no plan while its map or its odometry is too old.
        """
        recent = (
            robot.now_s - self.path_s <= MAX_PLAN_AGE_S
            and robot.now_s - self.command_s <= MAX_COMMAND_AGE_S
        )
        if not (self.search and recent and robot.fresh) or self.path is None or robot.pose is None:
            return None
        return goal_of(self.path, robot.pose)


@dataclass(frozen=True, slots=True)
class RobotNow:
    """The robot at one moment, on a monotonic clock and on its own, which may be simulated.

    fresh: whether its odometry is. pose: of its body on the map; None before the first odometry.
    frame: of its body, as its odometry names it. moving: whether it does, or may.
    """

    now_s: float
    stamp_ns: int
    fresh: bool
    pose: GoalPose | None
    frame: str = ""
    moving: bool = True


@dataclass(frozen=True, slots=True)
class GoalReport:
    """What the planner is told with the odometry, see there."""

    reached: GoalPose | None = None
    hold: str = ""
    refused: GoalPose | None = None


class Driver(Protocol):
    """Moves the robot, and stops it. What happens is said in sentences, for the log."""

    def step(self, robot: RobotNow, command: VelocityCommand | None, inputs: PlannerInputs) -> None:
        """Send what is to be sent now; ``command``: a velocity that the planner sent just now."""

    def problem(self) -> str:
        """Why the robot cannot be driven, in one sentence; empty if it can."""

    def report(self) -> GoalReport:
        """What the planner must know of the goals."""

    @property
    def idle(self) -> bool:
        """Whether nothing that it sent may move the robot."""

    def metrics(self) -> dict[str, float]:
        """Counts for health."""

    def close(self) -> None:
        """Stop the robot, at once, and then whatever else has to end."""
