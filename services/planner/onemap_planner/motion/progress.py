"""Noticing that the robot does not get on, and getting it free."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from onemap_planner.motion.pure_pursuit import Pose2d, Velocity
from onemap_shared.geometry import F64, wrap_angle

MOVED_M = 0.05  # less than this is noise of the odometry
MOVED_RAD = 0.1
COMMANDED_MPS = 0.04  # commands below these are the last touches at a goal
COMMANDED_RADPS = 0.15


@dataclass(frozen=True, slots=True)
class RecoveryParams:
    """When the robot counts as stuck; see ``PlannerConfig`` for the values."""

    stuck_s: float
    back_up_m: float
    back_up_s: float
    virtual_obstacle_s: float
    max_stuck_count: int
    stuck_radius_m: float
    bumper_m: float


@dataclass(frozen=True, slots=True)
class VirtualObstacle:
    """A place the robot ran into that no map shows, believed until ``until_s``."""

    xy: tuple[float, float]
    until_s: float


@dataclass(frozen=True, slots=True)
class ProgressMonitor:
    """How the robot gets on. Seconds are attentive seconds.

    moved_at and moved_s: the last pose that differed clearly, and when; backing_from: where
    backing up began, None when not; bumps: how often it got stuck near ``stuck_at``.
    """

    moved_at: Pose2d
    moved_s: float
    backing_from: Pose2d | None = None
    backing_since_s: float = 0.0
    stuck_count: int = 0
    stuck_at: Pose2d | None = None
    virtual_obstacles: tuple[VirtualObstacle, ...] = ()


def update_progress(
    progress: ProgressMonitor,
    pose: Pose2d,
    *,
    command: Velocity,
    collided: bool,
    now_s: float,
    params: RecoveryParams,
) -> ProgressMonitor:
    """The footing after a look at the pose: a new bump begins backing up, enough way ends it."""
    progress = replace(
        progress,
        virtual_obstacles=tuple(b for b in progress.virtual_obstacles if b.until_s > now_s),
    )
    if progress.backing_from is not None:
        done = pose.distance_to(progress.backing_from.xy) >= params.back_up_m
        if done or now_s - progress.backing_since_s >= params.back_up_s:
            return replace(progress, backing_from=None, moved_at=pose, moved_s=now_s)
        return progress
    driving = abs(command.linear_mps) > COMMANDED_MPS
    commanded = driving or abs(command.angular_radps) > COMMANDED_RADPS
    if not commanded or _moved(progress.moved_at, pose):
        progress = replace(progress, moved_at=pose, moved_s=now_s)
    if (collided and driving) or now_s - progress.moved_s > params.stuck_s:
        return _mark_stuck(progress, pose, driving=driving, now_s=now_s, params=params)
    return progress


def virtual_obstacles_xy(progress: ProgressMonitor) -> F64:
    """Places (B, 2) metres of all blocks."""
    return np.array([block.xy for block in progress.virtual_obstacles], dtype=np.float64).reshape(
        -1, 2
    )


def _moved(before: Pose2d, pose: Pose2d) -> bool:
    turned = abs(wrap_angle(pose.yaw_rad - before.yaw_rad))
    return pose.distance_to(before.xy) > MOVED_M or turned > MOVED_RAD


def _mark_stuck(
    progress: ProgressMonitor, pose: Pose2d, *, driving: bool, now_s: float, params: RecoveryParams
) -> ProgressMonitor:
    again = (
        progress.stuck_at is not None
        and pose.distance_to(progress.stuck_at.xy) < params.stuck_radius_m
    )
    virtual_obstacles = progress.virtual_obstacles
    if driving:
        x = pose.x_m + params.bumper_m * float(np.cos(pose.yaw_rad))
        y = pose.y_m + params.bumper_m * float(np.sin(pose.yaw_rad))
        virtual_obstacles = (
            *virtual_obstacles,
            VirtualObstacle((x, y), now_s + params.virtual_obstacle_s),
        )
    return replace(
        progress,
        backing_from=pose,
        backing_since_s=now_s,
        stuck_count=progress.stuck_count + 1 if again else 1,
        stuck_at=pose,
        virtual_obstacles=virtual_obstacles,
    )
