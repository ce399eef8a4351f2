"""One planning step: update the planner state, choose a motion.

Pure: time comes in with the observation, and the state is a value. The planning thread feeds
it from the bus, the tests from a grid world, the benchmark from a simulator in lockstep.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from onemap_planner.motion.motions import Motion, Pose2d, Rest, Reverse, Rotate
from onemap_planner.motion.progress import MotionSample, ProgressMonitor
from onemap_planner.policy.competition import with_found_object
from onemap_planner.policy.context import PlanningContext, across_gaps, build_context, with_change
from onemap_planner.policy.drive_to_place import drive_to_place
from onemap_planner.policy.evidence import finds_of, update_candidates
from onemap_planner.policy.explore import (
    can_follow,
    explore,
    follow_goal,
    follow_window,
    select_candidate,
    with_candidate_choice,
)
from onemap_planner.policy.goals import GoalCandidates
from onemap_planner.policy.object_order import revise_order, take_in_view, with_turn
from onemap_planner.policy.order_params import OrderMemory
from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.reopening import without_changed
from onemap_planner.policy.state import (
    Decision,
    Observation,
    PlannerState,
    TargetState,
    at_object,
    blacklist,
    latest_candidate,
    reject_candidate,
    with_doubt,
    with_more_time,
    with_pose,
)
from onemap_planner.policy.verify import approach, confirm
from onemap_planner.search.events import (
    CandidateSelected,
    Confirmed,
    Event,
    EventStamp,
    Exhausted,
    MapReady,
    MapRestarted,
    Rejected,
    Reordered,
    Rotated,
    SearchFailed,
    TargetFailed,
)
from onemap_planner.search.phases import (
    Approaching,
    Confirming,
    Driving,
    Exploring,
    LookingAround,
    Starting,
)
from onemap_planner.search.state_machine import driven_m, elapsed_s, transition
from onemap_planner.world.map_view import PlanningView, known_area_m2
from onemap_shared.geometry import F64, wrap_angle
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


def limit_reached(
    state: PlannerState, observation: Observation, params: PlannerParams
) -> Event | None:
    """The event that ends the search, or the object, whose limit is reached; None without."""
    search, budget = state.search, state.search.budget
    driven = driven_m(search, observation.odometer_m)
    if budget.max_distance_m and driven >= budget.max_distance_m:
        return SearchFailed(
            f"drove {driven:.1f} m, and this search may drive {budget.max_distance_m:g} m",
            FailureCode.DISTANCE_LIMIT,
        )
    if budget.max_time_s and elapsed_s(search, observation.now_s) >= budget.max_time_s:
        return SearchFailed(
            f"not done within {budget.max_time_s:g} s, the limit for this search",
            FailureCode.TIME_LIMIT,
        )
    limit_s = params.explore.object_limit_s
    if state.active_time_s - search.target_start.since_active_time_s > limit_s:
        missed = "not found" if search.target else "not reached"
        return TargetFailed(
            f"{missed} within {limit_s:.0f} s, the limit for one object", FailureCode.TIME_LIMIT
        )
    return None


MAX_WAIT_S = 300.0  # for stages that start: whoever asked is still there when the robot sets out
MAX_STEP_PERIOD_S = 1.0  # active time counted for one step: a longer pause was no searching
MAP_RESTART_FRACTION = 0.5  # a map whose known area falls below this part was begun again


# Chooses where to drive while no candidate is approached, as ``explore`` does.
Exploration = Callable[
    [PlannerState, PlanningContext, PlannerParams],
    tuple[PlannerState, Motion, Event | None, GoalCandidates],
]


def step(
    state: PlannerState,
    observation: Observation,
    params: PlannerParams,
    exploration: Exploration = explore,
) -> tuple[PlannerState, Decision | None]:
    """The next state and what to do; no decision while the inputs are stale or missing.

    exploration: that of another method, which a benchmark compares.
    """
    state = _advance_clock(with_turn(state, params.order), observation, params)
    if observation.stale_reason or observation.pose is None or observation.view is None:
        return _wait_for_inputs(state, observation, params), None
    before = state.pose or observation.pose
    state = with_pose(state, observation.pose)
    state, stuck = check_progress(state, observation, params)
    context = _context(
        state, observation.pose, observation.view, params, follow_window(state, observation, params)
    )
    if not context.whole and not can_follow(state, context):
        context = _context(state, observation.pose, observation.view, params, None)
    state = replace(state, appeared=context.appeared)
    state = _take_in_map(state, observation, context, params)
    turned_rad = max(0.0, wrap_angle(observation.pose.yaw_rad - before.yaw_rad))
    state, decision, events = _run_phase(state, context, turned_rad, params, exploration)
    if stuck:
        state, more = handle_stuck(state, params)
        events = (*more, *events)
    limit = limit_reached(state, observation, params)
    if limit is not None:
        events = (limit,)
    decision = replace(decision, finds=finds_of(state.search, events, context.map_view.grid))
    for event in events:
        state = _apply(state, event, observation)
    if state.progress is not None and state.progress.backing_from is not None:
        decision = replace(decision, motion=Reverse())
    return state, decision


def _context(
    state: PlannerState,
    pose: Pose2d,
    view: PlanningView,
    params: PlannerParams,
    window_xy: F64 | None,
) -> PlanningContext:
    context = build_context(
        pose,
        view,
        trail=state.trail,
        obstacles_xy=state.obstacles_xy,
        params=params.costmap,
        window_xy=window_xy,
    )
    context = with_change(context, state.appeared, view.stamp_ns * 1e-9)
    return across_gaps(context) if state.crosses_gaps else context


def _advance_clock(
    state: PlannerState, observation: Observation, params: PlannerParams
) -> PlannerState:
    """Active time passes only while the inputs are fresh.

    A second of creeping takes as much of a goal's time as its way does at full speed: else a door
    behind a metre of floor that no camera saw is given up halfway.
    """
    if observation.stale_reason:
        since_s = observation.now_s if state.stale_since_s is None else state.stale_since_s
        return replace(state, last_step_s=observation.now_s, stale_since_s=since_s)
    passed_s = 0.0 if state.last_step_s is None else observation.now_s - state.last_step_s
    passed_s = min(passed_s, MAX_STEP_PERIOD_S)
    if observation.creeps:
        drive = params.drive
        state = with_more_time(state, passed_s * (1 - drive.unseen_mps / drive.max_linear_mps))
    return replace(
        state,
        last_step_s=observation.now_s,
        stale_since_s=None,
        active_time_s=state.active_time_s + passed_s,
    )


def _wait_for_inputs(
    state: PlannerState, observation: Observation, params: PlannerParams
) -> PlannerState:
    """Fail after ``patience_s`` without fresh inputs, later while a stage starts."""
    if state.stale_since_s is None:
        return state
    waited_s = observation.now_s - state.stale_since_s
    patient_s = observation.now_s - max(state.stale_since_s, observation.patience_from_s)
    if patient_s <= params.explore.patience_s and waited_s <= MAX_WAIT_S:
        return state
    event = SearchFailed(
        f"waited {waited_s:.0f} s: {observation.stale_reason}", FailureCode.NO_INPUT
    )
    return _apply(state, event, observation)


def _take_in_map(
    state: PlannerState, observation: Observation, context: PlanningContext, params: PlannerParams
) -> PlannerState:
    """The state with the new detections; a map that was begun again resets what came from it."""
    known_m2 = known_area_m2(observation.view) if observation.view is not None else 0.0
    if known_m2 < MAP_RESTART_FRACTION * state.known_m2:
        state = replace(
            state,
            known_m2=known_m2,
            target_state=TargetState(),
            blacklisted_frontiers=(),
            unreached_frontiers=(),
            crosses_gaps=False,
            found_objects=(),
            other_targets=(),
            dead_ends=(),
            order_memory=OrderMemory(),
        )
        return _apply(state, MapRestarted(), observation)
    state = replace(state, known_m2=known_m2)
    frames = observation.detections
    if observation.other_view is not None:
        state = take_in_view(
            state,
            observation.other_view,
            lambda there, seen: update_candidates(
                there, frames, seen, params.consensus, near_m=params.goal.view_farthest_m
            ),
            context,
            params,
        )
    if not context.whole:
        return state
    state = without_changed(state, context.map_view, params.dead_end)
    return update_candidates(
        state, frames, context, params.consensus, near_m=params.goal.view_farthest_m
    )


def _run_phase(
    state: PlannerState,
    context: PlanningContext,
    turned_rad: float,
    params: PlannerParams,
    exploration: Exploration,
) -> tuple[PlannerState, Decision, tuple[Event, ...]]:
    """The state, the decision and the events of the present phase."""
    motion: Motion = Rest()
    event: Event | None = None
    revised: Reordered | None = None
    goal_candidates = GoalCandidates()
    match state.search.phase:
        case Starting():
            event = MapReady(context.known_fraction_around() < params.explore.known_around)
        case LookingAround():
            motion = Rotate()
            event = select_candidate(state, context, params) or Rotated(turned_rad)
        case Exploring() if not context.whole:
            state, motion, goal_candidates = follow_goal(state, context, params)
        case Exploring():
            event = select_candidate(state, context, params)
            if event is None:
                state, revised = revise_order(state, context, params)
            if event is None and (revised is None or revised.indices[0] == state.search.index):
                state, motion, event, goal_candidates = exploration(state, context, params)
        case Approaching() as phase:
            state, motion, event = approach(state, phase, context, params)
        case Confirming() as phase:
            state, motion, event = confirm(state, phase, context, params)
        case Driving(destination):
            state, motion, event = drive_to_place(state, destination, context, params)
        case _:
            pass
    if isinstance(event, Exhausted) and is_trapped(state, context.pose, params):
        event = stuck_failure(state)  # nothing was searched: no goal could be reached
    if isinstance(event, CandidateSelected):
        state = with_candidate_choice(state, event.candidate, context, params)
    goal = state.target_state.active_goal.goal if state.target_state.active_goal else None
    decision = Decision(motion, context.costmap, goal, goal_candidates)
    return state, decision, tuple(each for each in (revised, event) if each is not None)


def _apply(state: PlannerState, event: Event, observation: Observation) -> PlannerState:
    """The state after the event; the next object begins with an empty target state."""
    xy = observation.pose.xy if observation.pose else None
    stamp = EventStamp(observation.now_s, state.active_time_s, xy, observation.odometer_m)
    if isinstance(event, Confirmed):
        found = with_found_object(state.found_objects, state.search.target, event.candidate)
        state = replace(state, found_objects=found)
    search = transition(state.search, event, stamp)
    if search.index != state.search.index:
        state = at_object(state, search.index, keep=isinstance(event, Reordered))
    return replace(state, search=search)
