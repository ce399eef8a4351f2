"""The planned path as ``nav_msgs/Path``."""

from __future__ import annotations

from onemap_ros2.cdr import encode, header, new
from onemap_ros2.drive.goal_pose import GoalPose, stamped_pose
from onemap_ros2.ros_types import PATH
from onemap_shared.messages import PlannedPath


def path_message(path: PlannedPath, stamp_ns: int, frame: str) -> bytes:
    """The path's points as poses without a heading of their own; empty without a path."""
    poses = [
        stamped_pose(GoalPose(float(x), float(y), 0.0), stamp_ns, frame) for x, y in path.points_m
    ]
    return encode(new(PATH, header(stamp_ns, frame), poses), PATH)
