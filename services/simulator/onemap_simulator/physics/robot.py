"""Kinematics of a differential or holonomic drive, with limits of speed and acceleration.

Obstacles stop it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from pydantic import Field

from onemap_shared.geometry import F64, Velocity2d, pose_2d, wrap_angle
from onemap_shared.params import Params

# x, y in metres -> whether the robot's disc touches an obstacle
Collides = Callable[[float, float], bool]

STRAIGHT_RAD = 1e-9  # turning less than this, an arc is a line


class RobotParams(Params):
    """The robot's body and drive; the defaults are those of a small indoor base."""

    radius_m: float = Field(
        default=0.2, gt=0, le=10, description="Radius of the round footprint: passes any door."
    )
    max_linear_mps: float = Field(
        default=0.7, gt=0, le=5, description="Limit of the forward speed: a slow walk."
    )
    max_lateral_mps: float = Field(
        default=0.0,
        ge=0,
        le=5,
        description="Limit of the speed sideways; 0: a differential drive, which ignores commands "
        "to drive sideways. 0.3 for one with mecanum wheels.",
    )
    height_m: ClassVar[float] = 1.1  # passes below what is higher; just above the camera
    max_angular_radps: ClassVar[float] = 1.6  # one turn in 4 s
    linear_acceleration_mps2: ClassVar[float] = 1.0  # stops from full speed within 0.25 m
    angular_acceleration_radps2: ClassVar[float] = 3.0  # full turning speed after half a second


STOP = Velocity2d()


@dataclass(frozen=True, slots=True)
class RobotState:
    """Pose and velocity of the robot. ``collided``: an obstacle stopped the last step."""

    x_m: float
    y_m: float
    yaw_rad: float
    velocity: Velocity2d = STOP
    collided: bool = False

    @property
    def pose(self) -> F64:
        """T_map_body (4, 4), on the floor."""
        return pose_2d(self.x_m, self.y_m, self.yaw_rad)


def step(
    state: RobotState, command: Velocity2d, dt_s: float, *, params: RobotParams, collides: Collides
) -> RobotState:
    """The state ``dt_s`` seconds later, while the command stays as it is.

    Where the path would enter an obstacle, the robot stops before it; it may still turn on
    the spot, because it is round. ``dt_s`` times the speed must be small against any obstacle.
    """
    velocity = _accelerated(state.velocity, command, dt_s, params)
    # With constant acceleration the mean of both velocities is exact in length and angle.
    ahead = 0.5 * (state.velocity.linear_mps + velocity.linear_mps) * dt_s
    left = 0.5 * (state.velocity.lateral_mps + velocity.lateral_mps) * dt_s
    turn = 0.5 * (state.velocity.angular_radps + velocity.angular_radps) * dt_s
    yaw = wrap_angle(state.yaw_rad + turn)
    x, y = _along_arc(state, (ahead, left), turn)
    if (ahead != 0 or left != 0) and collides(x, y):
        stopped = replace(velocity, linear_mps=0.0, lateral_mps=0.0)
        return RobotState(state.x_m, state.y_m, yaw, stopped, collided=True)
    return RobotState(x, y, yaw, velocity)


def _accelerated(
    now: Velocity2d, command: Velocity2d, dt_s: float, params: RobotParams
) -> Velocity2d:
    """The velocity after ``dt_s`` seconds of limited acceleration towards the command."""
    change = params.linear_acceleration_mps2 * dt_s
    turn = params.angular_acceleration_radps2 * dt_s
    return Velocity2d(
        _towards(now.linear_mps, command.linear_mps, params.max_linear_mps, change),
        _towards(now.angular_radps, command.angular_radps, params.max_angular_radps, turn),
        _towards(now.lateral_mps, command.lateral_mps, params.max_lateral_mps, change),
    )


def _towards(now: float, wanted: float, limit: float, change: float) -> float:
    """``now`` moved towards ``wanted``, itself within +-limit, by at most ``change``."""
    target = min(max(wanted, -limit), limit)
    return min(max(target, now - change), now + change)


def _along_arc(
    state: RobotState, way_m: tuple[float, float], turn_rad: float
) -> tuple[float, float]:
    """End (x, y) in metres of an arc that turns by this angle.

    way_m: forwards and to the left, each the length that it has in the turning body frame.
    """
    begin, end = state.yaw_rad, state.yaw_rad + turn_rad
    if abs(turn_rad) < STRAIGHT_RAD:
        cos, sin = float(np.cos(begin)), float(np.sin(begin))
        ahead, left = way_m
    else:  # the means of cosine and sine over the turn, times it
        cos, sin = float(np.sin(end) - np.sin(begin)), -float(np.cos(end) - np.cos(begin))
        ahead, left = way_m[0] / turn_rad, way_m[1] / turn_rad
    return state.x_m + ahead * cos - left * sin, state.y_m + ahead * sin + left * cos
