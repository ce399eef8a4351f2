"""What a robot does about keep-out zones: leave the one that it stands in, and name others."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from onemap_planner.policy.context import APPROACH_NEAREST_M, PlanningContext
from onemap_planner.policy.outcome import Move
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.viewpoints import find_viewpoint
from onemap_planner.search.state_machine import without_choice
from onemap_planner.sentences import leaving_zone
from onemap_planner.world.candidates import ObjectCandidate

WITHIN_M = 0.005  # a robot that reaches less far into a zone has not entered it: rounding


def leave_zone(state: PlannerState, context: PlanningContext) -> Move | None:
    """Drive out of the zone that the robot stands in, by the shortest way; None if it is in none.

    Without a known way out it goes on as usual, where it stands: it may have to look around first.
    """
    keep_out, here = context.costmap.keep_out, np.array([context.pose.xy])
    radius_m = context.params.radius_m
    if keep_out is None or keep_out.distances_m(here, radius_m)[0] >= radius_m - WITHIN_M:
        return None
    name = context.zones.at(context.pose.xy, radius_m, keep_out.grid.cell_size_m)
    cost_m = np.where(keep_out.closed, np.inf, context.cost_to_go.cost_m)
    end = np.array(np.unravel_index(int(np.argmin(cost_m)), cost_m.shape))
    known = bool(np.isfinite(cost_m[tuple(end)]))
    state.search = replace(without_choice(state.search), slow=leaving_zone(name, known=known))
    if not known:
        return None
    state.active_goal = None
    end_xy = context.xy_of(end)
    ahead_xy = 2 * np.asarray(end_xy) - here[0]
    return Move(context.drive_to(end_xy, (float(ahead_xy[0]), float(ahead_xy[1]))))


def zone_before(candidates: Iterable[ObjectCandidate], context: PlanningContext) -> str:
    """The zone around one of the candidates that cannot be looked at; empty if none."""
    size_m = context.costmap.grid.cell_size_m
    for candidate in candidates if context.costmap.keep_out is not None else ():
        if find_viewpoint(candidate, context) is None:
            zone = context.zones.at(candidate.xyz[:2], APPROACH_NEAREST_M, size_m)
            if zone:
                return zone
    return ""
