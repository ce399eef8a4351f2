"""Where nav2 is to drive: the end of the planner's path, and what the robot faces there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from onemap_ros2.cdr import encode, header, new
from onemap_ros2.ros_types import POSE_STAMPED
from onemap_shared.geometry import F64, wrap_angle, yaw_of
from onemap_shared.messages import PlannedPath

NEAR_M = 0.05  # a direction over less than this is noise
TURN_RAD = math.pi / 2  # of a goal that makes the robot rotate where it stands


@dataclass(frozen=True, slots=True)
class GoalPose:
    """A pose on the floor, in the map frame."""

    x_m: float
    y_m: float
    yaw_rad: float

    def differs(self, other: GoalPose, distance_m: float, angle_rad: float) -> bool:
        """Whether the other one is further away, or turned by more."""
        far = math.hypot(self.x_m - other.x_m, self.y_m - other.y_m) > distance_m
        return far or abs(wrap_angle(self.yaw_rad - other.yaw_rad)) > angle_rad


def pose_of(T_map_body: F64) -> GoalPose:
    """The pose of the robot's body (4, 4) on the floor."""
    return GoalPose(float(T_map_body[0, 3]), float(T_map_body[1, 3]), yaw_of(T_map_body))


def goal_of(path: PlannedPath, robot: GoalPose) -> GoalPose | None:
    """The goal of a plan, from where the robot stands; None if it is not to move or to reverse.

    To rotate is a goal in place, a quarter turn further to the left than the robot is.
    """
    if path.motion == "rotate":
        return GoalPose(robot.x_m, robot.y_m, wrap_angle(robot.yaw_rad + TURN_RAD))
    return end_of(path, robot)


def end_of(path: PlannedPath, robot: GoalPose | None = None) -> GoalPose | None:
    """The end of a path that the robot is to drive; None if it is not to.

    Without the robot's pose it counts as where the path begins, along x.
    """
    if path.motion != "drive" or len(path.points_m) == 0:
        return None
    x_m, y_m = (float(value) for value in path.points_m[-1])
    start = robot or GoalPose(float(path.points_m[0, 0]), float(path.points_m[0, 1]), 0.0)
    return GoalPose(x_m, y_m, _heading_rad(path, start))


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


def pose_message(goal: GoalPose) -> object:
    """The goal as ``geometry_msgs/Pose``."""
    half = 0.5 * goal.yaw_rad
    return new(
        "geometry_msgs/msg/Pose",
        new("geometry_msgs/msg/Point", goal.x_m, goal.y_m, 0.0),
        new("geometry_msgs/msg/Quaternion", 0.0, 0.0, math.sin(half), math.cos(half)),
    )


def stamped_pose(goal: GoalPose, stamp_ns: int, frame: str) -> object:
    """The goal as ``geometry_msgs/PoseStamped``."""
    return new(POSE_STAMPED, header(stamp_ns, frame), pose_message(goal))


def encoded_pose(goal: GoalPose, stamp_ns: int, frame: str) -> bytes:
    """The goal as the bytes of a ``geometry_msgs/PoseStamped``."""
    return encode(stamped_pose(goal, stamp_ns, frame), POSE_STAMPED)
