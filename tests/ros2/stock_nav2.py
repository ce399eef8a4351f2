"""What nav2 does with its stock parameters: goals in, a velocity out, how each goal ended.

As bt_navigator and its SimpleActionServer have it: a goal that is replaced ends as aborted, with an
empty result. A goal is reached within ``TOLERANCE_M`` and ``TOLERANCE_RAD`` of the pose that was
asked for (SimpleGoalChecker, stateful): the robot drives no centimetre further.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy import ndimage

from onemap_planner.motion.motions import STOP, Pose2d
from onemap_planner.motion.path import cost_to_go_from, smooth_path
from onemap_shared.geometry import F64, Bool, Velocity2d, wrap_angle
from onemap_shared.grid import GridSpec

TOLERANCE_M, TOLERANCE_RAD = 0.25, 0.25  # xy_goal_tolerance, yaw_goal_tolerance
EXECUTING, SUCCEEDED, CANCELED, ABORTED = 2, 4, 5, 6  # of action_msgs/GoalStatus
CANCELLING, UNKNOWN, ENDED = 0, 2, 3  # of action_msgs/CancelGoal
SAME_M, SAME_RAD = 0.1, 0.1  # between goals that are one
SPEED_MPS, TURN_RADPS = 0.5, 1.0
AHEAD_M = 0.35  # the robot steers for the first point of its path that is so far away
TURN_FIRST_RAD = 0.7
NEAR_WALL = 4.0  # cost of floor beside a wall, falling to 1 at ``INFLATION_M`` more
INFLATION_M = 0.3


@dataclass
class StockNav2:
    """clearance_m (nx, ny): from each cell of the grid to the nearest obstacle, as nav2 knows it.

    states: of all goals by their ids. repeated: how many asked for the pose that the one before had
    reached.
    """

    grid: GridSpec
    clearance_m: F64
    radius_m: float = 0.2
    states: dict[bytes, int] = field(default_factory=dict)
    repeated: int = 0
    _reached: Pose2d | None = None
    _current: bytes = b""
    _pose: Pose2d | None = None
    _path: F64 | None = None
    _within: bool = False

    def goal(self, goal_id: bytes, pose: Pose2d) -> None:
        """Accept a goal; the one before is aborted."""
        self._end(ABORTED)
        self.repeated += self._reached is not None and _same(self._reached, pose)
        self._current, self._pose, self._reached = goal_id, pose, None
        self._path, self._within = None, False
        self.states[goal_id] = EXECUTING

    def cancel(self, goal_id: bytes) -> int:
        """The return code of a cancellation."""
        if goal_id not in self.states:
            return UNKNOWN
        if goal_id != self._current:
            return ENDED
        self._end(CANCELED)
        return CANCELLING

    def step(self, here: Pose2d) -> Velocity2d:
        """The velocity now."""
        if self._pose is None:
            return STOP
        self._within |= here.distance_to(self._pose.xy) <= TOLERANCE_M
        if self._within:
            error = wrap_angle(self._pose.yaw_rad - here.yaw_rad)
            if abs(error) > TOLERANCE_RAD:
                return _turn(error)
            self._end(SUCCEEDED)
            return STOP
        if self._path is None:
            self._path = self._way(here, self._pose)
        if self._path is None:
            self._end(ABORTED)
            return STOP
        return _steer(here, self._path)

    def _end(self, state: int) -> None:
        if self._current:
            self.states[self._current] = state
            self._reached = self._pose if state == SUCCEEDED else None
        self._current, self._pose = b"", None

    def _way(self, here: Pose2d, there: Pose2d) -> F64 | None:
        """The path (N, 2), metres, to the free cell nearest to the goal; None without any."""
        free: Bool = self.clearance_m >= self.radius_m
        start = self._nearest(free, here)
        beside = np.clip(1 - (self.clearance_m - self.radius_m) / INFLATION_M, 0, 1)
        cost = np.where(free, 1 + (NEAR_WALL - 1) * beside, -1.0)
        ways = cost_to_go_from(cost, start, cell_size_m=self.grid.cell_size_m)
        end = self._nearest(np.isfinite(ways.cost_m) & free, there)
        points: F64 = self.grid.centres(smooth_path(cost, ways.path_to(end)))
        if np.hypot(*(points[-1] - np.asarray(there.xy))) > 2 * TOLERANCE_M:
            return None
        return np.vstack([points[:-1], there.xy])

    def _nearest(self, free: Bool, pose: Pose2d) -> tuple[int, int]:
        cell = np.clip(self.grid.cells(np.asarray(pose.xy)), 0, np.array(free.shape) - 1)
        nearest = ndimage.distance_transform_edt(~free, return_distances=False, return_indices=True)
        x, y = nearest[:, cell[0], cell[1]]
        return int(x), int(y)


def _same(a: Pose2d, b: Pose2d) -> bool:
    return a.distance_to(b.xy) <= SAME_M and abs(wrap_angle(a.yaw_rad - b.yaw_rad)) <= SAME_RAD


def _turn(error_rad: float) -> Velocity2d:
    rate = min(TURN_RADPS, max(abs(error_rad), 0.3))
    return Velocity2d(0.0, float(np.copysign(rate, error_rad)))


def _steer(here: Pose2d, path: F64) -> Velocity2d:
    """Towards the first point ``AHEAD_M`` from here on the rest of the path."""
    dense = np.vstack([np.linspace(a, b, 20) for a, b in pairwise(path)])
    away = np.hypot(*(dense - np.asarray(here.xy)).T)
    nearest = int(away.argmin())
    ahead = nearest + int(np.argmax(away[nearest:] >= AHEAD_M))
    aim = dense[ahead] if away[ahead] >= AHEAD_M else dense[-1]
    error = here.bearing_to((float(aim[0]), float(aim[1])))
    if abs(error) > TURN_FIRST_RAD:
        return _turn(error)
    return Velocity2d(SPEED_MPS * float(np.cos(error)) ** 2, 1.5 * error)
