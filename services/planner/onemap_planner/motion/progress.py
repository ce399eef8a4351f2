"""Noticing that the robot does not get on, and getting it free."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from onemap_planner.motion.pure_pursuit import Pose, Velocity
from onemap_shared.geometry import F64, wrap_angle

MOVED_M = 0.05  # less than this is noise of the odometry
MOVED_RAD = 0.1
COMMANDED_MPS = 0.04  # commands below these are the last touches at a goal
COMMANDED_RADPS = 0.15


@dataclass(frozen=True, slots=True)
class RecoveryRules:
    """When the robot counts as stuck; see ``PlannerConfig`` for the values."""

    stuck_s: float
    back_up_m: float
    back_up_s: float
    block_s: float
    max_bumps: int
    bump_area_m: float
    bumper_m: float


@dataclass(frozen=True, slots=True)
class Block:
    """A place the robot ran into that no map shows, believed until ``until_s``."""

    xy: tuple[float, float]
    until_s: float


@dataclass(frozen=True, slots=True)
class Footing:
    """How the robot gets on. Seconds are attentive seconds.

    moved_at and moved_s: the last pose that differed clearly, and when; backing_from: where
    backing up began, None when not; bumps: how often it got stuck near ``bumped_at``.
    """

    moved_at: Pose
    moved_s: float
    backing_from: Pose | None = None
    backing_s: float = 0.0
    bumps: int = 0
    bumped_at: Pose | None = None
    blocks: tuple[Block, ...] = ()


def feel(
    footing: Footing,
    pose: Pose,
    *,
    command: Velocity,
    collided: bool,
    now_s: float,
    rules: RecoveryRules,
) -> Footing:
    """The footing after a look at the pose: a new bump begins backing up, enough way ends it."""
    footing = replace(footing, blocks=tuple(b for b in footing.blocks if b.until_s > now_s))
    if footing.backing_from is not None:
        done = pose.distance_to(footing.backing_from.xy) >= rules.back_up_m
        if done or now_s - footing.backing_s >= rules.back_up_s:
            return replace(footing, backing_from=None, moved_at=pose, moved_s=now_s)
        return footing
    driving = abs(command.linear_mps) > COMMANDED_MPS
    commanded = driving or abs(command.angular_radps) > COMMANDED_RADPS
    if not commanded or _moved(footing.moved_at, pose):
        footing = replace(footing, moved_at=pose, moved_s=now_s)
    if (collided and driving) or now_s - footing.moved_s > rules.stuck_s:
        return _bump(footing, pose, driving=driving, now_s=now_s, rules=rules)
    return footing


def blocks_xy(footing: Footing) -> F64:
    """Places (B, 2) metres of all blocks."""
    return np.array([block.xy for block in footing.blocks], dtype=np.float64).reshape(-1, 2)


def _moved(before: Pose, pose: Pose) -> bool:
    turned = abs(wrap_angle(pose.yaw_rad - before.yaw_rad))
    return pose.distance_to(before.xy) > MOVED_M or turned > MOVED_RAD


def _bump(
    footing: Footing, pose: Pose, *, driving: bool, now_s: float, rules: RecoveryRules
) -> Footing:
    again = (
        footing.bumped_at is not None and pose.distance_to(footing.bumped_at.xy) < rules.bump_area_m
    )
    blocks = footing.blocks
    if driving:
        x = pose.x_m + rules.bumper_m * float(np.cos(pose.yaw_rad))
        y = pose.y_m + rules.bumper_m * float(np.sin(pose.yaw_rad))
        blocks = (*blocks, Block((x, y), now_s + rules.block_s))
    return replace(
        footing,
        backing_from=pose,
        backing_s=now_s,
        bumps=footing.bumps + 1 if again else 1,
        bumped_at=pose,
        blocks=blocks,
    )
