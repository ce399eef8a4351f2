"""Collision monitor: limits a velocity so that the robot can stop on what the map knows is free.

Each command is checked against the newest costmap, forwards and backwards, as if it were the last
one: the path of the robot's disc while it arrives, to the end of its validity, and until the robot
stands, braking as hard as its limits allow. Where it may not act for as long as usual, it is made
shorter before it is made slower. The disc may touch no occupied cell and reach over unknown ones
only by ``unknown_overlap_m``, at the speed of a harmless touch where it comes over them anew, and
over the blind spot around its start at ``blind_mps``. It may not be where somebody who has just
appeared can have come by then. No part of it comes into a keep-out zone or over a drop. A robot
that already does any of this may move so that it does not get worse.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from onemap_planner.motion.accelerations import Steps, nearest_edges, points_until_it_stands
from onemap_planner.motion.motions import STOP, Pose2d
from onemap_planner.motion.pure_pursuit import DriveParams, limit_acceleration, limits, speeds
from onemap_planner.world.costmap import Costmap
from onemap_shared.geometry import F64, Bool, Velocity2d
from onemap_shared.messages import COMMAND_VALIDITY_MS

NOT_WORSE_M = 1e-6  # rounding of distances
ROUNDING_MPS = 1e-9  # of a speed that was limited before


@dataclass(frozen=True, slots=True)
class Walkers:
    """Where somebody appeared, and how near the robot may come.

    cells_xy (n, 2): centres in metres; seen_s: age of what the map shows, seconds; here_m: from the
    robot's centre to the nearest cell: who is too near already does not hold it there.
    """

    cells_xy: F64
    cell_size_m: float
    radius_m: float
    speed_mps: float
    seen_s: float
    here_m: float

    @classmethod
    def of(cls, pose: Pose2d, costmap: Costmap, seen_s: float) -> Walkers:
        """Those of a costmap."""
        cells = costmap.grid.centres(np.argwhere(costmap.appeared))
        size_m = costmap.grid.cell_size_m
        here_m = float(nearest_edges(np.array([pose.xy]), cells, size_m)[0])
        return cls(cells, size_m, costmap.params.radius_m, WALKER_MPS, seen_s, here_m)

    def allow(self, points: F64, step_s: float) -> bool:
        """Whether nobody can have come to the robot's disc on a path (N, 2), a point a step.

        Nor on one that leads away from who is near, however near.
        """
        if len(self.cells_xy) == 0:
            return True
        come_m = self.speed_mps * (self.seen_s + step_s * np.arange(1, len(points) + 1))
        away_m = nearest_edges(points, self.cells_xy, self.cell_size_m)
        return bool((away_m >= np.minimum(self.radius_m + come_m, self.here_m - NOT_WORSE_M)).all())


# m/s at which what has just appeared on free floor may come nearer until the robot stands: a walk
# at home.
WALKER_MPS = 1.0
FRACTIONS = (0.75, 0.5, 0.25)  # of the commanded speed that are tried, on the same arc
STEP_S = 0.05  # of the predicted path: at 0.7 m/s 35 mm, a third of a cell
CORNER_M = 0.02  # by which a path cuts corners: of known cells, and creeping of obstacles
PASSING = 0.5  # metres that an obstacle comes nearer per metre, at most: 30 degrees off its side
SLACK_M = 0.005  # of rounding and tracking: navigable cells lie a radius from obstacles as a whole


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

    def counting(self, action: MonitorAction) -> MonitorCounts:
        """The counts after another command."""
        began = action is not self.last
        return MonitorCounts(
            self.slowdowns + (began and action is MonitorAction.SLOWED),
            self.stops + (began and action is MonitorAction.STOPPED),
            action,
        )


def action_of(wanted: Velocity2d, command: Velocity2d) -> MonitorAction:
    """What was done to a wanted velocity, by the command that became of it."""
    if command.speed_mps >= wanted.speed_mps:
        return MonitorAction.PASSED
    return MonitorAction.SLOWED if command.speed_mps != 0.0 else MonitorAction.STOPPED


# Seconds that a command holds: as long as it may, or three control periods, so that no late command
# stops the robot.
VALIDITIES_S = (COMMAND_VALIDITY_MS / 1e3, 0.15)
# Seconds until a command acts, beyond what the pose was carried on by: a control period, the age of
# the odometry and the transport on one computer.
USUAL_DELIVERY_S = 0.15


@dataclass(frozen=True, slots=True)
class ControlTimes:
    """Seconds since the last command, of age of what the costmap shows, and until the next command
    acts, for which the robot keeps its velocity."""

    dt_s: float
    map_age_s: float = 0.0
    delivery_s: float = USUAL_DELIVERY_S


@dataclass(frozen=True, slots=True)
class CheckedCommand:
    """A velocity, and for how long it may act if no other follows, seconds."""

    velocity: Velocity2d = STOP
    validity_s: float = VALIDITIES_S[0]


def monitored(
    command: Velocity2d,
    previous: Velocity2d,
    pose: Pose2d,
    costmap: Costmap,
    params: DriveParams,
    *,
    times: ControlTimes,
) -> CheckedCommand:
    """The command, or the fastest one on its arc from which the robot can stop in time.

    previous: the velocity that the robot has. If no speed is safe the robot turns in place, and if
    it drives too fast for that it brakes on its arc, or at once where that is not safe either.
    """
    if previous.speed_mps == command.speed_mps == 0.0:
        return CheckedCommand(command)
    reach_m = _reach_m(command, previous, params, times.delivery_s)
    radius_m = costmap.params.radius_m
    here, surroundings = np.array(pose.xy), _Surroundings.of(pose, costmap, reach_m)
    walkers = Walkers.of(pose, costmap, times.map_age_s)
    v, w, left = command.linear_mps, command.angular_radps, command.lateral_mps
    limits_mps = (params.unseen_mps, params.blind_mps if len(surroundings.blind) else 0.0)
    limits = (mps / command.speed_mps for mps in limits_mps if 0 < mps < command.speed_mps)
    parts = sorted((*FRACTIONS, *limits), reverse=True)
    slower = [Velocity2d(v * part, w * part, left * part) for part in parts]

    def safe(path: F64, fastest_mps: float) -> bool:
        return (
            surroundings.allow(path, creeps=fastest_mps <= params.unseen_mps)
            and (not costmap.keep_out or costmap.keep_out.allows(here, path, radius_m, reach_m))
            and walkers.allow(path, STEP_S)
        )

    tried: set[Velocity2d] = set()
    for wanted in (command, *slower, Velocity2d(0.0, w)):
        candidate = limit_acceleration(wanted, previous, times.dt_s, params)
        if candidate in tried:
            continue
        tried.add(candidate)
        fastest_mps = max(candidate.speed_mps, previous.speed_mps)
        for validity_s in VALIDITIES_S:
            checked = CheckedCommand(candidate, validity_s)
            path = stopping_path(checked, previous, pose, params, delivery_s=times.delivery_s)
            if not safe(path, fastest_mps):
                continue
            if fastest_mps <= surroundings.limit_mps(path, params) + ROUNDING_MPS:
                return checked
    braking = CheckedCommand(
        limit_acceleration(STOP, previous, times.dt_s, params), VALIDITIES_S[-1]
    )
    path = stopping_path(braking, previous, pose, params, delivery_s=times.delivery_s)
    return braking if safe(path, previous.speed_mps) else CheckedCommand()


def stopping_path(
    command: CheckedCommand,
    previous: Velocity2d,
    pose: Pose2d,
    params: DriveParams,
    *,
    delivery_s: float,
) -> F64:
    """Positions (N, 2) metres, every ``STEP_S``, until the robot stands.

    It keeps the faster one of ``previous`` and the command until that has arrived, follows that to
    the end of its validity, and then brakes, within the limits of acceleration.
    """
    arrives = _steps(delivery_s)
    ends = arrives + _steps(command.validity_s)
    faster = max(previous, command.velocity, key=lambda each: each.speed_mps)
    steps = ends + _steps(faster.speed_mps / params.max_linear_mps2)
    x, y, yaw = float(pose.x_m), float(pose.y_m), float(pose.yaw_rad)
    return points_until_it_stands(
        (speeds(faster), speeds(command.velocity)),
        speeds(previous),
        (x, y, yaw),
        Steps(arrives, ends, steps, STEP_S),
        limits(params),
    )


def _steps(seconds: float) -> int:
    """Steps of the path that cover this time."""
    return int(np.ceil(seconds / STEP_S - 1e-9))


def _reach_m(
    command: Velocity2d, previous: Velocity2d, params: DriveParams, delivery_s: float
) -> float:
    """An upper bound of the length of ``stopping_path``, metres."""
    fastest = max(command.speed_mps, previous.speed_mps)
    acts_s = delivery_s + VALIDITIES_S[0] + 2 * STEP_S
    return fastest * acts_s + fastest**2 / (2 * params.max_linear_mps2)


@dataclass(frozen=True, slots=True)
class _Surroundings:
    """The cells that the robot's disc must keep away from, and how far its centre has to stay.

    here (1, 2): the robot's centre in metres. occupied and unknown (N, 2): centres in metres;
    occupied_m and unknown_m: metres to keep from their edges. drops (N, 2): occupied cells without
    floor. known (N, 2): cells that are not unknown, which the centre may leave by leave_m. unseen
    and blind (N, 2): cells that no camera saw, elsewhere and below its image at the start. here_m:
    metres from the centre to the nearest occupied cell; corner_m: to keep when creeping past one.
    """

    costmap: Costmap
    here: F64
    occupied: F64
    drops: F64
    unknown: F64
    known: F64
    unseen: F64
    blind: F64
    here_m: float
    occupied_m: float
    corner_m: float
    unknown_m: float
    leave_m: float

    @classmethod
    def of(cls, pose: Pose2d, costmap: Costmap, reach_m: float) -> _Surroundings:
        """The surroundings for paths of at most ``reach_m``. Beyond the grid all is unknown."""
        grid, radius_m = costmap.grid, costmap.params.radius_m
        around = int(np.ceil((reach_m + radius_m) / grid.cell_size_m)) + 1
        offsets = np.argwhere(np.ones((2 * around + 1, 2 * around + 1), bool)) - around
        cells = grid.cells(np.array(pose.xy)) + offsets
        inside, centres = grid.contains(cells), grid.centres(cells)
        at = tuple(np.clip(cells, 0, np.array(grid.shape) - 1).T)
        size, here = grid.cell_size_m, np.array([pose.xy])
        occupied = _without_own(centres[inside & costmap.occupied[at]], here, size, radius_m)
        known = inside & (costmap.free | costmap.occupied | costmap.passable)[at]
        unknown = centres[~known]
        keep_m = max(radius_m - costmap.params.unknown_overlap_m - CORNER_M - SLACK_M, 0.0)
        here_m = float(nearest_edges(here, occupied, size)[0])
        return cls(
            costmap,
            here,
            occupied,
            _without_own(centres[inside & costmap.drops[at]], here, size, radius_m),
            unknown,
            centres[known],
            centres[~inside | costmap.unseen[at]],
            centres[inside & costmap.blind[at]],
            here_m,
            min(radius_m - SLACK_M, here_m) - NOT_WORSE_M,
            min(radius_m - SLACK_M - CORNER_M, here_m) - NOT_WORSE_M,
            min(keep_m, float(nearest_edges(here, unknown, size)[0])) - NOT_WORSE_M,
            max(CORNER_M, float(nearest_edges(here, centres[known], size)[0])) + NOT_WORSE_M,
        )

    def allow(self, points: F64, *, creeps: bool) -> bool:
        """Whether the disc may take this path (N, 2), metres.

        creeps: a touch is harmless. Then it may come as near to an obstacle on its own trail as it
        has to where noise narrowed a door; and a path that passes an obstacle may come ``CORNER_M``
        nearer: without that the robot stood for ever a millimetre before a corner.
        """
        size, beside_m = self.costmap.grid.cell_size_m, self.costmap.params.radius_m + SLACK_M
        if self._covers(points, self.drops, beside_m):  # between two points too
            return False
        if (nearest_edges(points, self.unknown, size) < self.unknown_m).any():
            return False
        if (nearest_edges(points, self.known, size) > self.leave_m).any():
            return False
        near = nearest_edges(points, self.occupied, size)
        if creeps:
            back = self._returning(points) & (near >= self.costmap.params.radius_m / 2)
            near = np.where(back, np.inf, near)
        if not (near < self.occupied_m).any():
            return True
        return creeps and self._passes(points, near) and not (near < self.corner_m).any()

    def limit_mps(self, points: F64, params: DriveParams) -> float:
        """The speed that what the disc comes over on this path (N, 2) allows."""
        radius_m = self.costmap.params.radius_m - SLACK_M
        if self._covers(points, self.unseen, radius_m):
            return params.unseen_mps
        return params.blind_mps if self._covers(points, self.blind, radius_m) else np.inf

    def _covers(self, points: F64, cells: F64, radius_m: float) -> bool:
        """Whether the disc comes over cells (M, 2) on this path (N, 2) that it is not over yet."""
        if len(cells) == 0:
            return False
        size = self.costmap.grid.cell_size_m
        now = np.minimum(nearest_edges(cells, self.here, size), radius_m)
        closest = nearest_edges(cells, points, size)
        return bool((closest < now - NOT_WORSE_M).any())

    def _passes(self, points: F64, near: F64) -> bool:
        """Whether a path (N, 2) leads past the nearest obstacle, by its distances (N,) to it."""
        way_m = float(np.linalg.norm(np.diff(np.vstack([self.here, points]), axis=0), axis=1).sum())
        return bool(self.here_m - near[-1] <= PASSING * way_m)

    def _returning(self, points: F64) -> Bool:
        """Whether each point (N, 2) lies on the robot's own way back."""
        grid = self.costmap.grid
        cells = np.clip(grid.cells(points), 0, np.array(grid.shape) - 1)
        on_way: Bool = self.costmap.returning[tuple(cells.T)]
        return on_way


def _without_own(occupied: F64, here: F64, cell_size_m: float, radius_m: float) -> F64:
    """Centres (N, 2) of occupied cells without those of the robot itself.

    No obstacle reaches into the inner half of its disc. If the map has one there, it shows the
    robot as another one saw it, or is wrong about this place. What is not in the disc then stops
    the robot at its full radius: it must not come as near to a wall as it is to itself.
    """
    if len(occupied) == 0:
        return occupied
    away = nearest_edges(occupied, here, cell_size_m)
    if away.min() >= radius_m / 2:
        return occupied
    others: F64 = occupied[away >= radius_m - SLACK_M]
    return others
