"""Collision monitor: limits a velocity so that the robot can stop on what the map knows is free.

Each command is checked against the newest costmap, forwards and backwards: the path of the
robot's disc while the command acts for ``reaction_s`` and the robot then brakes as hard as its
limits allow. The disc may touch no occupied cell and reach over unknown ones only by
``unknown_overlap_m``. A robot that already does may move so that it does not get worse.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from onemap_planner.motion.motions import STOP, Pose2d
from onemap_planner.motion.pure_pursuit import DriveParams, limit_acceleration
from onemap_planner.world.costmap import Costmap
from onemap_shared.geometry import F64, Bool, Velocity2d

FRACTIONS = (0.75, 0.5, 0.25)  # of the commanded speed that are tried, on the same arc
STEP_S = 0.05  # of the predicted path: at 0.7 m/s 35 mm, a third of a cell
SLACK_M = 0.005  # of rounding and tracking: navigable cells lie a radius from obstacles as a whole
NOT_WORSE_M = 1e-6  # rounding of distances


class MonitorAction(Enum):
    """What the monitor did to a command: nothing, less speed, or none."""

    PASSED = "passed"
    SLOWED = "slowed"
    STOPPED = "stopped"


@dataclass(frozen=True, slots=True)
class MonitorCounts:
    """How often the monitor began to slow the robot down, and to stop it; ``last``: its action."""

    slowdowns: int = 0
    stops: int = 0
    last: MonitorAction = MonitorAction.PASSED

    def after(self, action: MonitorAction) -> MonitorCounts:
        """The counts after another command."""
        began = action is not self.last
        return MonitorCounts(
            self.slowdowns + (began and action is MonitorAction.SLOWED),
            self.stops + (began and action is MonitorAction.STOPPED),
            action,
        )


def action_of(wanted: Velocity2d, command: Velocity2d) -> MonitorAction:
    """What was done to a wanted velocity, by the command that became of it."""
    if abs(command.linear_mps) >= abs(wanted.linear_mps):
        return MonitorAction.PASSED
    return MonitorAction.SLOWED if command.linear_mps != 0.0 else MonitorAction.STOPPED


def monitored(
    command: Velocity2d,
    previous: Velocity2d,
    pose: Pose2d,
    costmap: Costmap,
    params: DriveParams,
    *,
    dt_s: float,
) -> Velocity2d:
    """The command, or the fastest one on its arc from which the robot can stop in time.

    previous: the velocity that the robot has, ``dt_s`` before the command. If no speed is safe the
    robot turns in place, and if it drives too fast for that it brakes on its arc.
    """
    if previous.linear_mps == command.linear_mps == 0.0:
        return command
    surroundings = _Surroundings.of(pose, costmap, _reach_m(command, previous, params))
    v, w = command.linear_mps, command.angular_radps
    slower = [Velocity2d(v * part, w * part) for part in FRACTIONS]
    for wanted in (command, *slower, Velocity2d(0.0, w)):
        candidate = limit_acceleration(wanted, previous, dt_s, params)
        path = stopping_path(wanted, previous, pose, params)
        slow = max(abs(wanted.linear_mps), abs(previous.linear_mps)) <= params.reverse_mps
        if surroundings.allow(path, slow=slow):
            return candidate
    return limit_acceleration(STOP, previous, dt_s, params)


def stopping_path(
    command: Velocity2d, previous: Velocity2d, pose: Pose2d, params: DriveParams
) -> F64:
    """Positions (N, 2) metres, every ``STEP_S``, until the robot stands.

    The velocity goes from ``previous`` to the command, and after ``reaction_s`` to zero, within
    the limits of acceleration.
    """
    reaction = int(np.ceil(params.reaction_s / STEP_S))
    fastest = max(abs(command.linear_mps), abs(previous.linear_mps))
    steps = reaction + int(np.ceil(fastest / (params.max_linear_mps2 * STEP_S)))
    velocity, points = previous, np.empty((steps, 2))
    x, y, yaw = pose.x_m, pose.y_m, pose.yaw_rad
    for i in range(steps):
        target = command if i < reaction else STOP
        after = limit_acceleration(target, velocity, STEP_S, params)
        # The mean of both velocities is exact in length and angle, the mean heading in direction.
        turn = 0.5 * (velocity.angular_radps + after.angular_radps) * STEP_S
        length = 0.5 * (velocity.linear_mps + after.linear_mps) * STEP_S
        x += length * float(np.cos(yaw + 0.5 * turn))
        y += length * float(np.sin(yaw + 0.5 * turn))
        yaw, velocity = yaw + turn, after
        points[i] = x, y
    return points


def _reach_m(command: Velocity2d, previous: Velocity2d, params: DriveParams) -> float:
    """An upper bound of the length of ``stopping_path``, metres."""
    fastest = max(abs(command.linear_mps), abs(previous.linear_mps))
    return fastest * (params.reaction_s + STEP_S) + fastest**2 / (2 * params.max_linear_mps2)


@dataclass(frozen=True, slots=True)
class _Surroundings:
    """The cells that the robot's disc must keep away from, and how far its centre has to stay.

    occupied and unknown (N, 2): centres in metres; occupied_m and unknown_m: metres to keep from
    their edges. crossable (N, 2): unknown cells that an escape may cross slowly.
    """

    costmap: Costmap
    occupied: F64
    unknown: F64
    crossable: F64
    occupied_m: float
    unknown_m: float

    @classmethod
    def of(cls, pose: Pose2d, costmap: Costmap, reach_m: float) -> _Surroundings:
        """The surroundings for paths of at most ``reach_m``. Beyond the grid all is unknown."""
        grid, radius_m = costmap.grid, costmap.params.radius_m
        around = int(np.ceil((reach_m + radius_m) / grid.cell_size_m)) + 1
        offsets = np.argwhere(np.ones((2 * around + 1, 2 * around + 1), bool)) - around
        cells = grid.cells(np.array(pose.xy)) + offsets
        inside, centres = grid.contains(cells), grid.centres(cells)
        at = tuple(np.clip(cells, 0, np.array(grid.shape) - 1).T)
        occupied = centres[inside & costmap.occupied[at]]
        crossable = inside & costmap.crossable[at]
        unknown = centres[~inside | ~(costmap.free | costmap.occupied | costmap.crossable)[at]]
        size, here = grid.cell_size_m, np.array([pose.xy])
        known_m = max(radius_m - costmap.params.unknown_overlap_m - SLACK_M, 0.0)
        return cls(
            costmap,
            occupied,
            unknown,
            centres[crossable],
            min(radius_m - SLACK_M, float(_edge_distance(here, occupied, size)[0])) - NOT_WORSE_M,
            min(known_m, float(_edge_distance(here, unknown, size)[0])) - NOT_WORSE_M,
        )

    def allow(self, points: F64, *, slow: bool) -> bool:
        """Whether the disc may take this path (N, 2), metres.

        slow: the robot drives no faster than backwards. Then it may cross what an escape needs, and
        come as near to an obstacle on its own trail as it has to where noise narrowed a door.
        """
        size = self.costmap.grid.cell_size_m
        if not slow and (_edge_distance(points, self.crossable, size) < self.unknown_m).any():
            return False
        if (_edge_distance(points, self.unknown, size) < self.unknown_m).any():
            return False
        near = _edge_distance(points, self.occupied, size)
        if slow:
            back = self._returning(points) & (near >= self.costmap.params.radius_m / 2)
            near = np.where(back, np.inf, near)
        return not bool((near < self.occupied_m).any())

    def _returning(self, points: F64) -> Bool:
        """Whether each point (N, 2) lies on the robot's own way back."""
        grid = self.costmap.grid
        cells = np.clip(grid.cells(points), 0, np.array(grid.shape) - 1)
        on_way: Bool = self.costmap.returning[tuple(cells.T)]
        return on_way


def _edge_distance(points: F64, centres: F64, cell_size_m: float) -> F64:
    """Distance (N,) of each point to the nearest edge of square cells; infinity without cells."""
    if len(centres) == 0:
        return np.full(len(points), np.inf)
    apart = np.abs(points[:, None] - centres[None]) - cell_size_m / 2
    outside = np.maximum(apart, 0.0)
    nearest: F64 = np.sqrt((outside**2).sum(axis=2).min(axis=1))
    return nearest
