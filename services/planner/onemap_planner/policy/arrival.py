"""Whether the robot has come to where it is to look from.

By the planner's own tolerance; or because the robot's own navigation, such as nav2, says so. That
ends a goal within a tolerance of its own, 0.25 m with nav2's stock parameters, and comes no nearer
when asked again. Where it stands then is good enough if the view from there is.
"""

from __future__ import annotations

from enum import Enum
from math import atan2, cos, sin

import numpy as np

from onemap_planner.motion.motions import Drive, Pose2d
from onemap_planner.motion.path import line_is_clear
from onemap_planner.motion.pure_pursuit import ARRIVE_M, ARRIVE_RAD, arrived
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.viewpoints import own_cells
from onemap_shared.geometry import wrap_angle

# Metres between two goals that are one for the robot's navigation: it gets no new goal for less.
SAME_GOAL_M = 0.4
# Metres that it may stand farther from what it looks at than the goal was: twice nav2's tolerance.
FARTHER_M = 0.5
# Radians between its heading and what it looks at: that is still in a view 60 degrees wide.
IN_VIEW_RAD = 0.4
# Metres within which the direction to what it looks at says nothing: the goal's heading counts.
CLOSE_M = 0.5


class ArrivalState(Enum):
    """How far the robot has come: not there, there, or as near as it comes, without the view."""

    ON_WAY = "on its way"
    THERE = "there"
    NO_VIEW = "no view"


def arrive(motion: Drive, context: PlanningContext) -> tuple[ArrivalState, Drive]:
    """Whether the robot is at the end of a path, and what to do: the motion, or a turn in place."""
    if arrived(motion, context.pose):
        return ArrivalState.THERE, motion
    end_xy = float(motion.points_xy[-1, 0]), float(motion.points_xy[-1, 1])
    reached = context.reached
    if reached is None or reached.distance_to(end_xy) > SAME_GOAL_M:
        return ArrivalState.ON_WAY, motion
    if not _sees(motion.look_xy, end_xy, context):
        final = comes_no_nearer(end_xy, context)
        return ArrivalState.NO_VIEW if final else ArrivalState.ON_WAY, motion
    yaw_rad = _heading_to(motion.look_xy, end_xy, context.pose)
    if abs(wrap_angle(yaw_rad - context.pose.yaw_rad)) <= IN_VIEW_RAD:
        return ArrivalState.THERE, motion
    if abs(wrap_angle(yaw_rad - reached.yaw_rad)) <= ARRIVE_RAD:  # it was asked, and turned so far
        return ArrivalState.NO_VIEW, motion
    x_m, y_m = context.pose.xy
    return ArrivalState.ON_WAY, Drive(
        np.array([(x_m, y_m)]), (x_m + cos(yaw_rad), y_m + sin(yaw_rad))
    )


def comes_no_nearer(xy: tuple[float, float], context: PlanningContext) -> bool:
    """Whether the robot's navigation was sent right there, metres, and says that it has come."""
    return context.reached is not None and context.reached.distance_to(xy) <= ARRIVE_M


def stands_at(xy: tuple[float, float], context: PlanningContext) -> bool:
    """Whether the robot stands at a viewpoint, metres, as near as it comes."""
    reached = context.reached
    return context.pose.distance_to(xy) <= 1.2 * ARRIVE_M or (
        reached is not None and reached.distance_to(xy) <= SAME_GOAL_M
    )


def _sees(
    look_xy: tuple[float, float], end_xy: tuple[float, float], context: PlanningContext
) -> bool:
    """Whether what is to be seen from the goal is in sight from here too, and not much farther."""
    away_m = Pose2d(*look_xy, 0.0).distance_to
    if away_m(context.pose.xy) > away_m(end_xy) + FARTHER_M:
        return False
    cells = context.costmap.grid.cells(np.array([context.pose.xy, end_xy, look_xy]))
    if not context.costmap.grid.contains(cells).all():
        return True
    here, end, look = cells
    occupied = context.costmap.occupied
    clear = ~occupied | own_cells(look[None], occupied.shape)
    return line_is_clear(clear, here, look) or not line_is_clear(clear, end, look)


def _heading_to(look_xy: tuple[float, float], end_xy: tuple[float, float], pose: Pose2d) -> float:
    """The heading with which the robot looks, from where it stands."""
    from_xy = pose.xy if pose.distance_to(look_xy) > CLOSE_M else end_xy
    return atan2(look_xy[1] - from_xy[1], look_xy[0] - from_xy[0])
