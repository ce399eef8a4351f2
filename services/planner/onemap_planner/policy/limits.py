"""What makes the robot give up a goal, or the search: stuck, no way, too far, too long."""

from __future__ import annotations

from math import inf

from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.progress import COMMANDED_MPS, MAX_STUCK_COUNT, STUCK_RADIUS_M, met_at
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.evidence import agreed
from onemap_planner.policy.outcome import Observation
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.take_in import TakenIn
from onemap_planner.search import state_machine as sm
from onemap_planner.sentences import STUCK_ON_WAY, left_aside, not_navigable, seen_out_of_reach
from onemap_shared.messages import FailureCode, SearchState

# With stale or missing inputs before the search fails: a restarted stage is back in half of it.
PATIENCE_S = 30.0
MAX_WAIT_S = 300.0  # for stages that start: whoever asked is still there when the robot sets out


def patience_over(state: PlannerState, observation: Observation) -> sm.Event | None:
    """The event that ends a search without fresh inputs: after ``PATIENCE_S``, later while a stage
    starts."""
    if state.stale_since_s is None:
        return None
    waited_s = observation.now_s - state.stale_since_s
    patient_s = observation.now_s - max(state.stale_since_s, observation.patience_from_s)
    if patient_s > PATIENCE_S or waited_s > MAX_WAIT_S:
        reason = f"gave up after {waited_s:.0f} s ({observation.stale_reason})"
        return _failed(reason, FailureCode.NO_INPUT)
    return None


def hindered(state: PlannerState, taken: TakenIn, observation: Observation) -> tuple[sm.Event, ...]:
    """Take in that the robot got stuck, or that its own navigation finds no way to its goal."""
    events: tuple[sm.Event, ...] = ()
    if taken.stuck:
        _note_contact(state, observation, taken.context)
        events = handle_stuck(state)
    if observation.refused != state.refused:
        state.refused = observation.refused
        if state.refused is not None:
            events = (*leave_goal(state, not_navigable(state.refused.xy)), *events)
    return events


def _note_contact(state: PlannerState, observation: Observation, context: PlanningContext) -> None:
    """Put what the robot got stuck at by driving on the next costmaps, unless this one has it."""
    command = observation.command
    if state.progress is None or observation.blocked or command.speed_mps <= COMMANDED_MPS:
        return
    met_xy = met_at(context.pose, command, context.costmap, state.obstacles_xy)
    state.progress = state.progress.ran_into(met_xy, state.active_time_s)


def handle_stuck(state: PlannerState) -> tuple[sm.Event, ...]:
    """Stuck ``MAX_STUCK_COUNT`` times in one place: give up the goal; twice as often: fail."""
    assert state.progress is not None
    stuck_count = state.progress.stuck_count
    if stuck_count >= 2 * MAX_STUCK_COUNT:
        return (stuck_failure(state),)
    return () if stuck_count % MAX_STUCK_COUNT else leave_goal(state)


def leave_goal(state: PlannerState, why: str = "") -> tuple[sm.Event, ...]:
    """Give up the goal that cannot be driven to; why: a place, which is the only one, fails.

    A candidate is rejected, until a search without another goal offers once more what was tried.
    """
    match state.search.phase:
        case sm.Approaching(candidate) | sm.Confirming(candidate, _):
            latest = state.evidence.latest(candidate)
            if state.progress is not None:
                state.ledger.looked_in_vain(latest, state.progress.moved_at.xy)
            state.reject(latest, why or STUCK_ON_WAY)
            return (sm.Rejected(),)
        case sm.Driving() if why:
            return (_failed(why, FailureCode.UNREACHABLE),)
        case _ if state.active_goal is not None:
            state.give_up(state.active_goal.goal)
    return ()


def is_trapped(state: PlannerState, pose: Pose2d) -> bool:
    """Whether the robot is still near the place where it got stuck too often."""
    progress = state.progress
    return (
        progress is not None
        and progress.stuck_at is not None
        and progress.stuck_count >= MAX_STUCK_COUNT
        and pose.distance_to(progress.stuck_at.xy) < STUCK_RADIUS_M
    )


def _failed(reason: str, code: FailureCode) -> sm.Ending:
    return sm.Ending(SearchState.FAILED, reason, code, whole=True)


def stuck_failure(state: PlannerState) -> sm.Ending:
    """The event that ends the search of a robot that is stuck."""
    assert state.progress is not None
    x, y = state.progress.moved_at.xy
    return _failed(f"the robot is stuck at ({x:.1f}, {y:.1f})", FailureCode.STUCK)


def limit_reached(
    state: PlannerState, observation: Observation, limit_s: float = inf
) -> sm.Event | None:
    """The event that ends the search, or the object, whose limit is reached; None without.

    limit_s: of one object; the search's own limits are in its budget, and count while it waits too.
    """
    search, budget = state.search, state.search.budget
    driven = sm.driven_m(search, observation.odometer_m)
    if budget.max_distance_m and driven >= budget.max_distance_m:
        reason = f"drove {driven:.1f} m; the limit for this search is {budget.max_distance_m:g} m"
        return _failed(reason, FailureCode.DISTANCE_LIMIT)
    if budget.max_time_s and sm.elapsed_s(search, observation.now_s) >= budget.max_time_s:
        reason = f"not done within {budget.max_time_s:g} s, the limit for this search"
        return _failed(reason, FailureCode.TIME_LIMIT)
    if state.active_time_s - search.target_start.since_active_time_s > limit_s:
        missed = "not found" if search.target else "not reached"
        reason = f"{missed} within {limit_s:.0f} s, the limit for one object"
        if isinstance(search.phase, sm.Exploring) and (seen := agreed(state)):
            reason += seen_out_of_reach(seen[0].xyz[:2], seen[0].sightings)
        reason += left_aside([(each.position_m, each.reason) for each in search.passed])
        return sm.Ending(SearchState.FAILED, reason, FailureCode.TIME_LIMIT)
    return None
