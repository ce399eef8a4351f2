"""What getting stuck means for the search: give up the goal, the candidate or the search."""

from __future__ import annotations

from dataclasses import replace

from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.progress import MotionSample, ProgressMonitor
from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.state import (
    Observation,
    PlannerState,
    blacklist,
    latest_candidate,
    reject_candidate,
    with_doubt,
)
from onemap_planner.search.events import Event, Rejected, SearchFailed
from onemap_planner.search.phases import Approaching, Confirming
from onemap_shared.messages import FailureCode


def check_progress(
    state: PlannerState, observation: Observation, params: PlannerParams
) -> tuple[PlannerState, bool]:
    """The state with its progress monitor updated, and whether the robot got stuck just now."""
    assert observation.pose is not None
    if state.progress is None:
        progress = ProgressMonitor(observation.pose, state.active_time_s)
        return replace(state, progress=progress), False
    sample = MotionSample(
        observation.pose,
        observation.command,
        observation.collided,
        state.active_time_s,
        observation.blocked,
    )
    progress = state.progress.update(
        sample, params.recovery, front_m=params.costmap.min_clearance_m
    )
    stuck = progress.backing_from is not None and state.progress.backing_from is None
    return replace(state, progress=progress), stuck


def handle_stuck(
    state: PlannerState, params: PlannerParams
) -> tuple[PlannerState, tuple[Event, ...]]:
    """Stuck ``max_stuck_count`` times in one place: give up the goal; twice as often: fail."""
    assert state.progress is not None
    stuck_count = state.progress.stuck_count
    if stuck_count >= 2 * params.recovery.max_stuck_count:
        return state, (stuck_failure(state),)
    if stuck_count % params.recovery.max_stuck_count:
        return state, ()
    match state.search.phase:
        case Approaching(candidate) | Confirming(candidate, _):
            latest = latest_candidate(state, candidate, params.consensus)
            # The way failed, not the candidate: detected from elsewhere, it is taken up again.
            state = with_doubt(state, latest, state.progress.moved_at.xy)
            return reject_candidate(state, latest), (Rejected(),)
        case _ if state.target_state.active_goal is not None:
            return blacklist(state, state.target_state.active_goal.goal, reached=False), ()
        case _:
            return state, ()


def is_trapped(state: PlannerState, pose: Pose2d, params: PlannerParams) -> bool:
    """Whether the robot is still near the place where it got stuck too often."""
    progress = state.progress
    return (
        progress is not None
        and progress.stuck_at is not None
        and progress.stuck_count >= params.recovery.max_stuck_count
        and pose.distance_to(progress.stuck_at.xy) < params.recovery.stuck_radius_m
    )


def stuck_failure(state: PlannerState) -> SearchFailed:
    """The event that ends the search of a robot that is stuck."""
    assert state.progress is not None
    x, y = state.progress.moved_at.xy
    return SearchFailed(f"the robot is stuck at ({x:.1f}, {y:.1f})", FailureCode.STUCK)
