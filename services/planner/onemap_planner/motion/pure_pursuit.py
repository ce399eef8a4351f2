"""Regulated pure pursuit as in nav2, for a differential drive and for a holonomic one.

The speed is limited by the curvature of the arc, by the clearance and by the end of the path; the
accelerations by what the robot can do. A holonomic robot drives towards the lookahead point in any
direction but backwards, and turns to it while it drives.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field, PositiveFloat

from onemap_planner.motion.accelerations import Limits, Speeds, limited
from onemap_planner.motion.motions import STOP, Drive, Motion, Pose2d, Rest, Reverse, Rotate
from onemap_planner.world.costmap import CLEAR_M, Costmap
from onemap_shared.geometry import F64, Velocity2d, wrap_angle
from onemap_shared.params import Params

MIN_SPEED_MPS = 0.05  # so that the last centimetres of a path are driven too
SIDEWAYS_RAD = np.pi / 2  # from the heading: a holonomic robot turns before it drives backwards
TURN_TO_LOOK_M = 0.8  # before the end of the path a holonomic robot begins to face its goal
IN_VIEW_RAD = 0.6  # between heading and way then: the camera still sees where it drives


# Metres from the path's end that count as there: about one map cell.
ARRIVE_M = 0.12
# Radians from the wanted heading: a tenth of the camera's view.
ARRIVE_RAD = 0.15
# rad/s of a look around: every direction is seen for 1.4 s.
LOOK_AROUND_RADPS = 1.0


class DriveParams(Params):
    """Speeds, accelerations and tolerances of the drive."""

    max_linear_mps: PositiveFloat = Field(
        default=0.7, description="Top speed in m/s: slow walking."
    )
    max_angular_radps: PositiveFloat = Field(
        default=1.5, description="Top turning rate in rad/s: a blur of 4 degrees at 20 frames/s."
    )
    max_lateral_mps: float = Field(
        default=0.0,
        ge=0,
        description="Top speed sideways in m/s, of a holonomic robot; 0: a differential drive, as "
        "most robots have. 0.3 for mecanum or omni wheels: the camera looks elsewhere.",
    )
    max_linear_mps2: PositiveFloat = Field(
        default=1.0, description="Acceleration in m/s^2: stops from top speed within 0.25 m."
    )
    unseen_stop_m: PositiveFloat = Field(
        default=0.9,
        description="Metres within which the robot comes to stand, from what its map shows: the "
        "age of the map times the speed, and braking. A camera at 1 m sees the floor from 1.1 m "
        "on, 0.9 m before the robot's front. Top speed up to an age of 0.9 s.",
    )

    max_angular_radps2: ClassVar[float] = 3.0  # turning acceleration in rad/s^2
    # Acceleration sideways on an arc in m/s^2, half of that along it: 0.7 m/s on a radius of 1 m,
    # 0.4 m/s on one of 0.3 m, so that it does not leave the path in a turn.
    max_lateral_mps2: ClassVar[float] = 0.5
    reverse_mps: ClassVar[float] = 0.15  # m/s backwards: no camera looks there
    # m/s at which the robot's body comes over cells that no camera saw, and on its own trail nearer
    # than its radius to obstacles: slow enough to touch them without harm.
    unseen_mps: ClassVar[float] = 0.045
    # m/s over the blind spot around its start, beyond which it saw floor: what could stand there is
    # low and small, and it stops within 0.1 m of touching it.
    blind_mps: ClassVar[float] = 0.3
    # Metres; the smallest pursuit distance that does not weave at 0.7 m/s.
    lookahead_m: ClassVar[float] = 0.4
    # Heading error in radians above which the robot turns before it drives.
    turn_in_place_rad: ClassVar[float] = 0.7
    slow_clearance_m: ClassVar[float] = CLEAR_M  # clearance in metres below which it slows down
    # Part of the top speed at which it passes the narrowest places.
    slow_fraction: ClassVar[float] = 0.4


def target_velocity(
    motion: Motion,
    pose: Pose2d,
    costmap: Costmap | None,
    params: DriveParams,
    *,
    lookahead_part: float = 1.0,
) -> Velocity2d:
    """The target velocity of a motion, within the speed limits.

    lookahead_part: of the lookahead distance; with less, the robot cuts corners less.
    Without a costmap the robot keeps to the speed of the narrowest places.
    """
    match motion:
        case Rest():
            return STOP
        case Rotate():
            return Velocity2d(0.0, LOOK_AROUND_RADPS)
        case Reverse():
            return Velocity2d(-params.reverse_mps, 0.0)
        case Drive(points_xy, look_xy):
            to_end_m = pose.distance_to((float(points_xy[-1, 0]), float(points_xy[-1, 1])))
            if to_end_m <= ARRIVE_M:
                return _rotate_by(_heading_error(pose, look_xy), params)
            if params.max_lateral_mps > 0:
                return _holonomic_pursuit(motion, pose, costmap, params, lookahead_part)
            return _pure_pursuit(points_xy, pose, costmap, params, lookahead_part)


def speed_on_map_mps(map_age_s: float, params: DriveParams) -> float:
    """The speed at which the robot stands within ``unseen_stop_m`` on a map of this age.

    The root of v T + v^2 / (2 a) = s.
    """
    braking = params.max_linear_mps2 * map_age_s
    root = float(np.sqrt(braking**2 + 2 * params.max_linear_mps2 * params.unseen_stop_m))
    return min(root - braking, params.max_linear_mps)


def arrived(motion: Motion, pose: Pose2d) -> bool:
    """Whether the robot is at the end of the path and faces ``look_xy``."""
    if not isinstance(motion, Drive):
        return False
    end = motion.points_xy[-1]
    near = pose.distance_to((float(end[0]), float(end[1]))) <= 1.2 * ARRIVE_M
    return near and abs(_heading_error(pose, motion.look_xy)) <= ARRIVE_RAD


def limit_acceleration(
    wanted: Velocity2d, previous: Velocity2d, dt_s: float, params: DriveParams
) -> Velocity2d:
    """The velocity nearest to ``wanted`` that the limits allow ``dt_s`` after ``previous``."""
    return Velocity2d(*limited(speeds(wanted), speeds(previous), dt_s, limits(params)))


def speeds(velocity: Velocity2d) -> Speeds:
    """As compiled functions take them."""
    return Speeds(
        float(velocity.linear_mps), float(velocity.angular_radps), float(velocity.lateral_mps)
    )


def limits(params: DriveParams) -> Limits:
    """As compiled functions take them."""
    top = Speeds(params.max_linear_mps, params.max_angular_radps, params.max_lateral_mps)
    return Limits(top, params.max_linear_mps2, params.max_angular_radps2)


def _heading_error(pose: Pose2d, look_xy: tuple[float, float]) -> float:
    """Angle from the heading to ``look_xy``; 0 when the robot is on it."""
    return pose.bearing_to(look_xy) if pose.distance_to(look_xy) > 0.05 else 0.0


def _pure_pursuit(
    points_xy: F64,
    pose: Pose2d,
    costmap: Costmap | None,
    params: DriveParams,
    lookahead_part: float,
) -> Velocity2d:
    """Velocity towards the point one lookahead further along the path."""
    aim, remaining_m = _lookahead_point(points_xy, pose, lookahead_part * params.lookahead_m)
    error = pose.bearing_to(aim)
    if abs(error) > params.turn_in_place_rad:
        return _rotate_by(error, params)
    # Brake in time: v^2 = 2 a s, with half of the allowed deceleration as reserve.
    speed = min(params.max_linear_mps, float(np.sqrt(params.max_linear_mps2 * remaining_m)))
    distance_m = max(pose.distance_to(aim), 1e-3)
    curvature = 2.0 * float(np.sin(error)) / distance_m
    speed = min(speed, float(np.sqrt(params.max_lateral_mps2 / max(abs(curvature), 1e-3))))
    speed = max(speed * _clearance_factor(pose, aim, costmap, params), MIN_SPEED_MPS)
    angular = curvature * speed
    if abs(angular) > params.max_angular_radps:
        speed *= params.max_angular_radps / abs(angular)
        angular = float(np.copysign(params.max_angular_radps, angular))
    return Velocity2d(speed, angular)


def _holonomic_pursuit(
    motion: Drive, pose: Pose2d, costmap: Costmap | None, params: DriveParams, lookahead_part: float
) -> Velocity2d:
    """Velocity towards the lookahead point, in any direction but backwards.

    The robot turns to where it drives, so that its camera sees the way; shortly before the end it
    turns to what it is to look at, as far as the way stays in view.
    """
    lookahead_m = lookahead_part * params.lookahead_m
    aim, remaining_m = _lookahead_point(motion.points_xy, pose, lookahead_m)
    error = pose.bearing_to(aim)
    if abs(error) > SIDEWAYS_RAD:
        return _rotate_by(error, params)
    facing = error
    if remaining_m <= TURN_TO_LOOK_M:
        away = wrap_angle(_heading_error(pose, motion.look_xy) - error)
        facing = error + float(np.clip(away, -IN_VIEW_RAD, IN_VIEW_RAD))
    fastest = top_speed_mps(error, params)
    speed = min(fastest, float(np.sqrt(params.max_linear_mps2 * remaining_m)))
    slowest = min(MIN_SPEED_MPS, fastest)
    speed = max(speed * _clearance_factor(pose, aim, costmap, params), slowest)
    turning = _rotate_by(facing, params).angular_radps
    return Velocity2d(speed * float(np.cos(error)), turning, speed * float(np.sin(error)))


def top_speed_mps(bearing_rad: float, params: DriveParams) -> float:
    """Top speed towards a bearing of at most pi / 2: an ellipse between ahead and sideways."""
    lateral_mps = min(params.max_lateral_mps, params.max_linear_mps)
    ahead = float(np.cos(bearing_rad)) / params.max_linear_mps
    return float(1 / np.hypot(ahead, float(np.sin(bearing_rad)) / lateral_mps))


def _lookahead_point(
    points_xy: F64, pose: Pose2d, lookahead_m: float
) -> tuple[tuple[float, float], float]:
    """The lookahead point and the length of path left from the robot to its end, metres."""
    here = np.asarray(pose.xy)
    if len(points_xy) == 1:
        return (float(points_xy[0, 0]), float(points_xy[0, 1])), pose.distance_to(
            (float(points_xy[0, 0]), float(points_xy[0, 1]))
        )
    legs = np.diff(points_xy, axis=0)
    lengths = np.maximum(np.hypot(legs[:, 0], legs[:, 1]), 1e-9)
    along = np.clip(((here - points_xy[:-1]) * legs).sum(axis=1) / lengths**2, 0.0, 1.0)
    feet = points_xy[:-1] + along[:, None] * legs
    nearest = int(np.argmin(np.hypot(*(feet - here).T)))
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    at_m = starts[nearest] + along[nearest] * lengths[nearest]
    aim_m = min(at_m + lookahead_m, starts[-1])
    x = float(np.interp(aim_m, starts, points_xy[:, 0]))
    y = float(np.interp(aim_m, starts, points_xy[:, 1]))
    return (x, y), float(starts[-1] - at_m)


def _clearance_factor(
    pose: Pose2d, aim: tuple[float, float], costmap: Costmap | None, params: DriveParams
) -> float:
    """Fraction of the top speed that the clearance here and at the lookahead point allows."""
    if costmap is None:
        return params.slow_fraction
    cells = costmap.grid.cells(np.array([pose.xy, aim]))
    cells = cells[costmap.grid.contains(cells)]
    if len(cells) == 0:
        return params.slow_fraction
    clearance = float(costmap.clearance_m[cells[:, 0], cells[:, 1]].min())
    return float(np.clip(clearance / params.slow_clearance_m, params.slow_fraction, 1.0))


def _rotate_by(error_rad: float, params: DriveParams) -> Velocity2d:
    """Rotate in place, braking in time to stop at the right heading."""
    rate = min(params.max_angular_radps, float(np.sqrt(params.max_angular_radps2 * abs(error_rad))))
    return Velocity2d(0.0, float(np.copysign(rate, error_rad)) if abs(error_rad) > 1e-3 else 0.0)
