"""What a robot's limits make of its velocities, the path until it stands, and how near it comes to
cells; compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from onemap_shared.geometry import F64
from onemap_shared.jit import compiled


class Speeds(NamedTuple):
    """Forwards and to the left in m/s, turning in rad/s: a ``Velocity2d``."""

    linear_mps: float
    angular_radps: float
    lateral_mps: float


class Limits(NamedTuple):
    """Top speeds and accelerations, as in ``DriveParams``."""

    speeds: Speeds
    linear_mps2: float
    angular_radps2: float


class Steps(NamedTuple):
    """Of a path: until the command arrives, until it ends, and in all; each takes ``step_s``."""

    arrives: int
    ends: int
    all: int
    step_s: float


@compiled
def limited(wanted: Speeds, previous: Speeds, dt_s: float, limits: Limits) -> Speeds:
    """The speeds nearest to ``wanted`` that the limits allow ``dt_s`` after ``previous``."""
    step_mps, step_radps = limits.linear_mps2 * dt_s, limits.angular_radps2 * dt_s
    top = limits.speeds
    ahead = wanted.linear_mps - previous.linear_mps
    left = wanted.lateral_mps - previous.lateral_mps
    linear, lateral = wanted.linear_mps, wanted.lateral_mps
    if left == 0.0:
        linear = previous.linear_mps + min(max(ahead, -step_mps), step_mps)
    else:  # changed by at most step_mps in all
        change = np.hypot(ahead, left)
        if change > step_mps * (1 + 1e-9):  # what was limited before stays as it is
            part = step_mps / change
            linear = previous.linear_mps + part * ahead
            lateral = previous.lateral_mps + part * left
    turn = min(max(wanted.angular_radps - previous.angular_radps, -step_radps), step_radps)
    return Speeds(
        min(max(linear, -top.linear_mps), top.linear_mps),
        min(max(previous.angular_radps + turn, -top.angular_radps), top.angular_radps),
        min(max(lateral, -top.lateral_mps), top.lateral_mps),
    )


@compiled
def points_until_it_stands(
    wanted: tuple[Speeds, Speeds],
    previous: Speeds,
    pose: tuple[float, float, float],
    steps: Steps,
    limits: Limits,
) -> F64:
    """Positions (N, 2) metres after each step from ``pose``: x, y, yaw.

    wanted: until the command arrives, and until it ends; rest after that.
    """
    points, velocity = np.empty((steps.all, 2)), previous
    x, y, yaw = pose
    for i in range(steps.all):
        target = Speeds(0.0, 0.0, 0.0)
        if i < steps.arrives:
            target = wanted[0]
        elif i < steps.ends:
            target = wanted[1]
        after = limited(target, velocity, steps.step_s, limits)
        # The mean of both velocities is exact in length and angle, the mean heading in direction.
        turn = 0.5 * (velocity.angular_radps + after.angular_radps) * steps.step_s
        ahead = 0.5 * (velocity.linear_mps + after.linear_mps) * steps.step_s
        left = 0.5 * (velocity.lateral_mps + after.lateral_mps) * steps.step_s
        cos, sin = np.cos(yaw + 0.5 * turn), np.sin(yaw + 0.5 * turn)
        x, y = x + ahead * cos - left * sin, y + ahead * sin + left * cos
        yaw, velocity = yaw + turn, after
        points[i, 0], points[i, 1] = x, y
    return points


@compiled
def nearest_edges(points: F64, centres: F64, cell_size_m: float) -> F64:
    """Distance (N,) of each point to the nearest edge of M square cells; infinity without any."""
    nearest = np.full(len(points), np.inf)
    for i in range(len(points)):
        for j in range(len(centres)):
            x = max(abs(points[i, 0] - centres[j, 0]) - cell_size_m / 2, 0.0)
            y = max(abs(points[i, 1] - centres[j, 1]) - cell_size_m / 2, 0.0)
            nearest[i] = min(nearest[i], np.sqrt(x * x + y * y))
    return nearest
