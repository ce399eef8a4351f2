"""One thought: from what is sensed now and remembered to what the robot does next.

Pure: time comes in, a decision goes out, and the mind is a value. The service feeds it
from the bus; the tests feed it from a grid world.
"""

from __future__ import annotations

from dataclasses import replace

from onemap_planner.motion.motions import Motion, Rest, Reverse, Rotate
from onemap_planner.motion.progress import MotionSample, ProgressMonitor
from onemap_planner.policy.competition import (
    conflicting_object,
    count_contradictions,
    found_under_other_names,
    with_found_object,
)
from onemap_planner.policy.context import PlanningContext, build_context
from onemap_planner.policy.explore import explore, reachable_candidate
from onemap_planner.policy.goals import GoalCandidates
from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.state import (
    Decision,
    Observation,
    PlannerState,
    TargetState,
    blacklist,
    latest_candidate,
    reject_candidate,
    with_pose,
)
from onemap_planner.policy.verify import approach, confirm
from onemap_planner.search.phases import (
    Approaching,
    Confirmed,
    Confirming,
    Event,
    EventStamp,
    Exhausted,
    Exploring,
    LookingAround,
    MapReady,
    MapRestarted,
    Rejected,
    Rotated,
    SearchFailed,
    Starting,
    TargetFailed,
)
from onemap_planner.search.state_machine import transition
from onemap_planner.world.candidates import (
    ObjectCandidate,
    is_same_object,
    merge_sightings,
    sightings_of,
)
from onemap_shared.geometry import wrap_angle
from onemap_shared.messages import Detections

MAX_STEP_PERIOD_S = 1.0  # more than this between two thoughts is no attention
MAP_RESTART_FRACTION = 0.5  # a map that shrinks to less than this began anew


def step(
    state: PlannerState, observation: Observation, params: PlannerParams
) -> tuple[PlannerState, Decision | None]:
    """The next state of mind and what to do; no decision while the senses are not fresh."""
    state = _advance_clock(state, observation)
    if observation.stale_reason or observation.pose is None or observation.view is None:
        return _wait_for_inputs(state, observation, params), None
    before = state.pose or observation.pose
    state = with_pose(state, observation.pose)
    state, stuck = _check_progress(state, observation, params)
    context = build_context(
        observation.pose,
        observation.view,
        trail=state.trail,
        obstacles_xy=state.obstacles_xy,
        params=params.costmap,
    )
    state = _update_candidates(state, observation, context, params)
    turned_rad = max(0.0, wrap_angle(observation.pose.yaw_rad - before.yaw_rad))
    state, decision, events = _run_phase(state, context, turned_rad, params)
    if stuck:
        state, more = _handle_stuck(state, params)
        events = (*more, *events)
    if (
        state.active_time_s - state.search.target_start.since_active_time_s
        > params.explore.object_limit_s
    ):
        limit_s = params.explore.object_limit_s
        events = (TargetFailed(f"not found within {limit_s:.0f} s, the limit for one object"),)
    for event in events:
        state = _apply(state, event, observation)
    if state.progress is not None and state.progress.backing_from is not None:
        decision = replace(decision, motion=Reverse())
    return state, decision


def _advance_clock(state: PlannerState, observation: Observation) -> PlannerState:
    """Clocks: attentive seconds pass only while nothing is to complain about."""
    passed_s = 0.0 if state.last_step_s is None else observation.now_s - state.last_step_s
    if observation.stale_reason:
        since_s = observation.now_s if state.stale_since_s is None else state.stale_since_s
        return replace(state, last_step_s=observation.now_s, stale_since_s=since_s)
    return replace(
        state,
        last_step_s=observation.now_s,
        stale_since_s=None,
        active_time_s=state.active_time_s + min(passed_s, MAX_STEP_PERIOD_S),
    )


def _wait_for_inputs(
    state: PlannerState, observation: Observation, params: PlannerParams
) -> PlannerState:
    """Wait for the senses, but not for ever."""
    if state.stale_since_s is None:
        return state
    waited_s = observation.now_s - state.stale_since_s
    if waited_s <= params.explore.patience_s:
        return state
    return _apply(
        state, SearchFailed(f"waited {waited_s:.0f} s: {observation.stale_reason}"), observation
    )


def _check_progress(
    state: PlannerState, observation: Observation, params: PlannerParams
) -> tuple[PlannerState, bool]:
    """The mind with its footing, and whether the robot got stuck just now."""
    assert observation.pose is not None
    if state.progress is None:
        progress = ProgressMonitor(observation.pose, state.active_time_s)
        return replace(state, progress=progress), False
    sample = MotionSample(
        observation.pose, observation.command, observation.collided, state.active_time_s
    )
    progress = state.progress.update(
        sample, params.recovery, front_m=params.costmap.min_clearance_m
    )
    stuck = progress.backing_from is not None and state.progress.backing_from is None
    return replace(state, progress=progress), stuck


def _update_candidates(
    state: PlannerState, observation: Observation, context: PlanningContext, params: PlannerParams
) -> PlannerState:
    """The mind with the new sightings, and aware of a map that began anew."""
    known_m2 = context.known_m2()
    if known_m2 < MAP_RESTART_FRACTION * state.known_m2:
        state = replace(
            state,
            known_m2=known_m2,
            target_state=TargetState(),
            blacklisted_frontiers=(),
            found_objects=(),
        )
        return _apply(state, MapRestarted(), observation)
    candidates = state.target_state.candidates
    for detections in observation.detections:
        candidates = _add_detections(candidates, detections, state, context, params)
    others = found_under_other_names(state.found_objects, state.search.target, state.synonyms)
    free = tuple(c for c in candidates if conflicting_object(c, others, context.map_view) is None)
    return replace(
        state, known_m2=known_m2, target_state=replace(state.target_state, candidates=free)
    )


def _add_detections(
    candidates: tuple[ObjectCandidate, ...],
    detections: Detections,
    state: PlannerState,
    context: PlanningContext,
    params: PlannerParams,
) -> tuple[ObjectCandidate, ...]:
    """The candidates after the detections of one frame."""
    target, map_view, limits = state.search.target, context.map_view, params.consensus
    fresh = [
        sighting
        for sighting in sightings_of(
            target, detections, map_view, seen_from=context.pose.xy, params=limits
        )
        if not any(is_same_object(gone, sighting, limits) for gone in state.target_state.rejected)
    ]
    candidates = merge_sightings(candidates, fresh, limits)
    return count_contradictions(
        candidates, detections, fresh, target=target, map_view=map_view, params=limits
    )


def _run_phase(
    state: PlannerState, context: PlanningContext, turned_rad: float, params: PlannerParams
) -> tuple[PlannerState, Decision, tuple[Event, ...]]:
    """What the present phase does."""
    motion: Motion = Rest()
    event: Event | None = None
    goal_candidates = GoalCandidates()
    match state.search.phase:
        case Starting():
            event = MapReady(context.known_fraction_around() < params.explore.known_around)
        case LookingAround():
            motion, event = (
                Rotate(),
                reachable_candidate(state, context, params) or Rotated(turned_rad),
            )
        case Exploring():
            event = reachable_candidate(state, context, params)
            if event is None:
                state, motion, event, goal_candidates = explore(state, context, params)
            if isinstance(event, Exhausted) and _is_trapped(state, context, params):
                event = _stuck_failure(state)  # nothing was searched: it could not get there
        case Approaching() as phase:
            state, motion, event = approach(state, phase, context, params)
        case Confirming() as phase:
            state, motion, event = confirm(state, phase, context, params)
        case _:
            pass
    goal = state.target_state.active_goal.goal if state.target_state.active_goal else None
    decision = Decision(motion, context.costmap, goal, goal_candidates)
    return state, decision, () if event is None else (event,)


def _handle_stuck(
    state: PlannerState, params: PlannerParams
) -> tuple[PlannerState, tuple[Event, ...]]:
    """After too many bumps in one place give up the goal, after twice as many the search."""
    assert state.progress is not None
    stuck_count = state.progress.stuck_count
    if stuck_count >= 2 * params.recovery.max_stuck_count:
        return state, (_stuck_failure(state),)
    if stuck_count % params.recovery.max_stuck_count:
        return state, ()
    match state.search.phase:
        case Approaching(candidate) | Confirming(candidate, _):
            return reject_candidate(state, latest_candidate(state, candidate, params.consensus)), (
                Rejected(),
            )
        case _ if state.target_state.active_goal is not None:
            return blacklist(state, state.target_state.active_goal.goal), ()
        case _:
            return state, ()


def _is_trapped(state: PlannerState, context: PlanningContext, params: PlannerParams) -> bool:
    """Whether the robot has not got away from where it bumped too often."""
    progress = state.progress
    return (
        progress is not None
        and progress.stuck_at is not None
        and progress.stuck_count >= params.recovery.max_stuck_count
        and context.pose.distance_to(progress.stuck_at.xy) < params.recovery.stuck_radius_m
    )


def _stuck_failure(state: PlannerState) -> SearchFailed:
    assert state.progress is not None
    x, y = state.progress.moved_at.xy
    return SearchFailed(f"the robot is stuck at ({x:.1f}, {y:.1f})")


def _apply(state: PlannerState, event: Event, observation: Observation) -> PlannerState:
    """The mind after the event; a new object begins with an empty quest."""
    xy = observation.pose.xy if observation.pose else None
    stamp = EventStamp(observation.now_s, state.active_time_s, xy, observation.odometer_m)
    if isinstance(event, Confirmed):
        found_objects = with_found_object(state.found_objects, state.search.target, event.candidate)
        state = replace(state, found_objects=found_objects)
    search = transition(state.search, event, stamp)
    target_state = state.target_state if search.index == state.search.index else TargetState()
    return replace(state, search=search, target_state=target_state)
