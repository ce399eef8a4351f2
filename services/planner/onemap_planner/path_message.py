"""The message ``search/path``: path, goal, frontiers and regions, for display."""

from __future__ import annotations

import numpy as np

from onemap_planner.motion.motions import Drive, Motion, Reverse, Rotate
from onemap_planner.policy.goals import GoalKind
from onemap_planner.policy.outcome import Decision
from onemap_planner.search.phases import Approaching, Confirming, Driving, Exploring, Search
from onemap_shared.geometry import F32, F64
from onemap_shared.messages import PlannedPath

NO_GOAL = "none"


def planned_path(search: Search, decision: Decision | None, stamp_ns: int) -> PlannedPath:
    """The message of a decision; empty without one, or when the search is over."""
    if decision is None or not search.active:
        return _message(stamp_ns, NO_GOAL, search.reason, decision=None)
    match search.phase:
        case Approaching() | Confirming():
            return _message(stamp_ns, str(GoalKind.DETECTION), search.reason, decision=decision)
        case Exploring() if decision.goal is not None:
            goal = decision.goal
            return _message(stamp_ns, str(goal.kind), goal.reason, decision=decision)
        case Driving() if decision.goal is not None:
            reason = decision.goal.reason
            return _message(stamp_ns, str(search.kind), reason, decision=decision)
        case _:
            return _message(stamp_ns, NO_GOAL, search.reason, decision=decision)


def _message(stamp_ns: int, kind: str, reason: str, *, decision: Decision | None) -> PlannedPath:
    points = np.zeros((0, 2))
    look: tuple[float, ...] = ()
    frontiers, frontier_scores = np.zeros((0, 2)), np.zeros(0)
    regions, region_scores = np.zeros((0, 2)), np.zeros(0)
    if decision is not None:
        if isinstance(decision.motion, Drive):
            points = decision.motion.points_xy
            look = (float(decision.motion.look_xy[0]), float(decision.motion.look_xy[1]))
        else:
            kind = NO_GOAL  # the robot rests, rotates or backs up
        offered = decision.goal_candidates
        frontiers = _stack([frontier.beyond_xy for frontier in offered.frontiers])
        frontier_scores = np.array([frontier.score for frontier in offered.frontiers])
        regions = _stack([region.peak_xy for region in offered.regions])
        region_scores = np.array([region.score for region in offered.regions])
    return PlannedPath(
        stamp_ns=stamp_ns,
        goal_kind=kind,
        goal_reason=reason,
        points_m=_f32(points),
        goal_m=_f32(points[-1:] if kind != NO_GOAL else points[:0]),
        frontiers_m=_f32(frontiers),
        frontier_scores=_f32(frontier_scores),
        regions_m=_f32(regions),
        region_scores=_f32(region_scores),
        motion=_name(decision.motion) if decision is not None else "",
        look_m=look,
    )


def _name(motion: Motion) -> str:
    """The motion as the message names it."""
    match motion:
        case Drive():
            return "drive"
        case Rotate():
            return "rotate"
        case Reverse():
            return "reverse"
    return "rest"


def _stack(places: list[F64]) -> F64:
    return np.array(places, dtype=np.float64).reshape(-1, 2)


def _f32(values: F64) -> F32:
    return values.astype(np.float32)
