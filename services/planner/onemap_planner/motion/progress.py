"""Progress checker: detects a robot that does not move as commanded, and backs it up."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field, PositiveFloat

from onemap_planner.motion.motions import Pose2d
from onemap_planner.world.costmap import Costmap
from onemap_shared.geometry import F64, Velocity2d, wrap_angle
from onemap_shared.params import Params

MOVED_M = 0.05  # less than this is noise of the odometry
MOVED_RAD = 0.1
COMMANDED_MPS = 0.04  # smaller commands are the last corrections at a goal
COMMANDED_RADPS = 0.15


BACK_UP_M = 0.2  # metres to back up: one radius
BACK_UP_S = 2.5  # seconds after which backing up ends anyway
# Seconds that an obstacle which the robot ran into, but no map shows, stays on the costmap:
# long enough to take another way, short enough for a door that opens.
VIRTUAL_OBSTACLE_S = 60.0
# Metres by which the map may show an obstacle too far away: a cell and an error of the depth.
MAP_ERROR_M = 0.15
# Times stuck in one place after which the goal is given up; after twice as many the search
# fails, unless the map shows what is in the way.
MAX_STUCK_COUNT = 3
# Metres within which two places where it got stuck are one.
STUCK_RADIUS_M = 1.0


class RecoveryParams(Params):
    """When the robot counts as stuck, and how it backs up."""

    stuck_s: PositiveFloat = Field(
        default=3.0,
        description="Seconds without moving although commanded: well above any start-up.",
    )


@dataclass(frozen=True, slots=True)
class MotionSample:
    """Pose, velocity that the plan wants and collision flag at ``now_s`` (active time, seconds).

    blocked: the costmap does not allow this velocity, so that the robot stands.
    """

    pose: Pose2d
    command: Velocity2d
    collided: bool
    now_s: float
    blocked: bool = False


@dataclass(frozen=True, slots=True)
class VirtualObstacle:
    """A point (metres) that the robot ran into, on the costmap until ``until_s``."""

    xy: tuple[float, float]
    until_s: float


@dataclass(frozen=True, slots=True)
class ProgressMonitor:
    """State of the progress checker. Seconds are active time.

    moved_at and moved_s: the last pose that differed clearly, and when; backing_from: where
    backing up began, None when not; stuck_count: how often it got stuck near ``stuck_at``.
    """

    moved_at: Pose2d
    moved_s: float
    backing_from: Pose2d | None = None
    backing_since_s: float = 0.0
    stuck_count: int = 0
    stuck_at: Pose2d | None = None
    virtual_obstacles: tuple[VirtualObstacle, ...] = ()

    @property
    def obstacles_xy(self) -> F64:
        """Points (B, 2), metres, of the virtual obstacles."""
        points = [obstacle.xy for obstacle in self.virtual_obstacles]
        return np.array(points, dtype=np.float64).reshape(-1, 2)

    def update(self, sample: MotionSample, params: RecoveryParams) -> ProgressMonitor:
        """The monitor after one sample: stuck, it starts to back up; distance or time ends that."""
        pose, now_s = sample.pose, sample.now_s
        valid = tuple(o for o in self.virtual_obstacles if o.until_s > now_s)
        monitor = replace(self, virtual_obstacles=valid)
        if monitor.backing_from is not None:
            done = pose.distance_to(monitor.backing_from.xy) >= BACK_UP_M
            if done or now_s - monitor.backing_since_s >= BACK_UP_S:
                return replace(monitor, backing_from=None, moved_at=pose, moved_s=now_s)
            return monitor
        driving = sample.command.speed_mps > COMMANDED_MPS
        commanded = driving or abs(sample.command.angular_radps) > COMMANDED_RADPS
        if not commanded or _moved(monitor.moved_at, pose):
            monitor = replace(monitor, moved_at=pose, moved_s=now_s)
        if (sample.collided and driving) or now_s - monitor.moved_s > params.stuck_s:
            return _backing_up(monitor, sample)
        return monitor

    def ran_into(self, xy: tuple[float, float], now_s: float) -> ProgressMonitor:
        """The monitor with a virtual obstacle at this point, metres."""
        obstacle = VirtualObstacle(xy, now_s + VIRTUAL_OBSTACLE_S)
        return replace(self, virtual_obstacles=(*self.virtual_obstacles, obstacle))


def _moved(before: Pose2d, pose: Pose2d) -> bool:
    turned = abs(wrap_angle(pose.yaw_rad - before.yaw_rad))
    return pose.distance_to(before.xy) > MOVED_M or turned > MOVED_RAD


def met_at(
    pose: Pose2d, command: Velocity2d, costmap: Costmap, before_xy: F64
) -> tuple[float, float]:
    """Where (metres) a robot that drove by this command ran into something.

    A contact does not tell its direction. It is that of the nearest obstacle of the costmap on the
    side that the robot drove to, if the map may show it ``MAP_ERROR_M`` too far away; else it is
    straight ahead, since the map shows nothing. before_xy (B, 2): where it met something before,
    metres: from there it keeps away by now, so it was not that again.
    """
    front_m, size_m = costmap.params.min_clearance_m, costmap.grid.cell_size_m
    towards = pose.yaw_rad + float(np.arctan2(command.lateral_mps, command.linear_mps))
    ahead = front_m * np.array([np.cos(towards), np.sin(towards)])
    away = costmap.grid.centres(np.argwhere(costmap.occupied)) - pose.xy
    away_m = np.hypot(*away.T) - size_m / 2
    away_m[away @ ahead < 0] = np.inf
    met = ahead
    if away_m.min(initial=np.inf) <= front_m + MAP_ERROR_M:
        nearest = away[away_m.argmin()]
        met = front_m * nearest / np.hypot(*nearest)
        if (np.hypot(*(before_xy - pose.xy - met).T) <= MAP_ERROR_M).any():
            met = ahead
    return float(pose.x_m + met[0]), float(pose.y_m + met[1])


def _backing_up(monitor: ProgressMonitor, sample: MotionSample) -> ProgressMonitor:
    """The monitor that starts backing up here, and counts how often it got stuck here.

    What the map shows in the way ends no search: somebody may stand there. It only counts up to
    ``max_stuck_count``, over and over.
    """
    again = (
        monitor.stuck_at is not None
        and sample.pose.distance_to(monitor.stuck_at.xy) < STUCK_RADIUS_M
    )
    earlier = monitor.stuck_count if again else 0
    if sample.blocked:
        earlier %= MAX_STUCK_COUNT
    return replace(
        monitor,
        backing_from=sample.pose,
        backing_since_s=sample.now_s,
        stuck_count=earlier + 1,
        stuck_at=sample.pose,
    )
