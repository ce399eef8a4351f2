"""One planning step: take in what is new, choose a motion.

Pure: time comes in with the observation, and the state that comes in stays as it is. The planning
thread feeds it from the bus, the tests from a grid world, the benchmark from a simulator in
lockstep.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf, radians

import numpy as np
from pydantic import Field, PositiveFloat

from onemap_planner.motion.motions import Pose2d, Reverse, Rotate
from onemap_planner.motion.progress import (
    COMMANDED_MPS,
    MAX_STUCK_COUNT,
    STUCK_RADIUS_M,
    MotionSample,
    ProgressMonitor,
    RecoveryParams,
    met_at,
)
from onemap_planner.motion.pure_pursuit import DriveParams
from onemap_planner.motion.staleness import StalenessParams
from onemap_planner.policy.context import (
    Bands,
    PlanningContext,
    across_gaps,
    build_context,
    creeping_reason,
)
from onemap_planner.policy.displaced import notice, stand
from onemap_planner.policy.evidence import finds_of, found_under_other_names, update_evidence
from onemap_planner.policy.explore import (
    can_follow,
    explore,
    follow_goal,
    follow_window,
    select_candidate,
)
from onemap_planner.policy.outcome import Decision, Move, Observation, Outcome
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.verify import approach, confirm, sort_out
from onemap_planner.policy.ways import drive_to_place
from onemap_planner.policy.zones import leave_zone
from onemap_planner.search.state_machine import (
    Approaching,
    Confirmed,
    Confirming,
    Driving,
    Ending,
    Event,
    EventStamp,
    Exploring,
    LookingAround,
    MapReady,
    MapRestarted,
    Rejected,
    Rotated,
    Starting,
    driven_m,
    elapsed_s,
    transition,
)
from onemap_planner.sentences import not_navigable
from onemap_planner.world.candidates import CONSENSUS, Consensus
from onemap_planner.world.costmap import BesideMap, CostmapParams
from onemap_planner.world.description import Description, described
from onemap_planner.world.map_view import known_area_m2
from onemap_shared.geometry import F64, wrap_angle
from onemap_shared.messages import NO_DETAIL, Detail, FailureCode, SearchState
from onemap_shared.params import Params
from onemap_shared.places import Zones


class ExploreParams(Params):
    """How near a robot goes to what it finds, and how long it seeks."""

    approach_farthest_m: float = Field(
        default=1.1,
        ge=0.8,
        le=1.25,
        description="Metres from the object's surface at which it counts as reached.",
    )
    object_limit_s: PositiveFloat = Field(
        default=600.0, description="Seconds per object; a flat of 100 m2 takes about 200."
    )


class PlannerParams(Params):
    """All parameters of a planning step, one group for each subject."""

    costmap: CostmapParams = Field(
        default=CostmapParams(), description="The robot's size, in metres, against the map."
    )
    explore: ExploreParams = Field(
        default=ExploreParams(), description="The end of the way to an object, and its time."
    )
    drive: DriveParams = Field(
        default=DriveParams(), description="Speeds and accelerations of driving along a path."
    )
    staleness: StalenessParams = Field(
        default=StalenessParams(),
        description="How old, in seconds, the inputs may be: older ones stop the robot.",
    )
    recovery: RecoveryParams = Field(
        default=RecoveryParams(), description="When the robot counts as stuck."
    )


# Known part of the 1 m circle below which the robot first looks around: one view shows 22 percent,
# in a corner 45 percent can be known.
KNOWN_AROUND = 0.4
OVERLAP_DEG = 10.0  # of the first and the last view of a look around: the error of the heading
# With stale or missing inputs before the search fails: a restarted stage is back in half of it.
PATIENCE_S = 30.0
MAX_WAIT_S = 300.0  # for stages that start: whoever asked is still there when the robot sets out
CREEPS_S = 1.0  # of creeping before the search says why: less is a corner
MAX_STEP_PERIOD_S = 1.0  # active time counted for one step: a longer pause was no searching
# A map without an id whose known area falls below this part was begun again.
MAP_RESTART_FRACTION = 0.5

# Chooses where to drive while no candidate is approached, as ``explore`` does.
Exploration = Callable[[PlannerState, PlanningContext], Move]


def step(
    state: PlannerState,
    observation: Observation,
    params: PlannerParams,
    exploration: Exploration = explore,
    consensus: Consensus = CONSENSUS,
) -> Outcome:
    """The state after the observation and what to do.

    exploration and consensus: those of another method, which a benchmark compares.
    """
    state = state.copy()
    notice(state, observation, params.drive)
    _advance_clock(state, observation, params)
    pose, view = observation.pose, observation.view
    if observation.stale_reason or pose is None or view is None:
        _wait_for_inputs(state, observation)
        if (limit := limit_reached(state, observation)) is not None:
            _apply(state, limit, observation)
        return Outcome(state)
    turned_rad = wrap_angle(pose.yaw_rad - (state.pose or pose).yaw_rad)
    state.move_to(pose)
    stuck = check_progress(state, observation, params)
    context = _context(state, pose, observation, params, follow_window(state, observation))
    if not context.whole and not can_follow(state, context):
        context = _context(state, pose, observation, params, None)
    bands = Bands(params.explore.approach_farthest_m, observation.camera)
    context = replace(
        context,
        consensus=consensus,
        bands=bands,
        reached=observation.reached,
        description=_description(state.search.detail, observation, context),
    )
    state.appeared, state.cost_to_go = context.appeared, context.cost_to_go
    slow = creeping_reason(context) if state.crept_s >= CREEPS_S else ""
    slow = slow or (not_navigable(observation.refused.xy) if observation.refused else "")
    state.search = replace(state.search, slow=slow)
    _take_in_map(state, observation, context)
    aside = stand(state) or leave_zone(state, context)
    if aside is None:
        move, events = _run_phase(state, context, max(0.0, turned_rad), exploration)
    else:
        move, events = aside, (aside.event,) if aside.event else ()
    active = state.active_goal
    goal = active.goal if active else None
    if stuck:
        note_contact(state, observation, context)
        events = (*handle_stuck(state), *events)
    if observation.refused != state.refused:
        state.refused = observation.refused
        if state.refused is not None:
            events = (*leave_goal(state, not_navigable(state.refused.xy)), *events)
    limit = limit_reached(state, observation, params.explore.object_limit_s)
    if limit is not None:
        events = (limit,)
    finds = finds_of(state.search, events, context.map_view.grid)
    for event in events:
        _apply(state, event, observation)
    backs_up = state.progress is not None and state.progress.backing_from is not None
    motion = Reverse() if backs_up else move.motion
    return Outcome(state, Decision(motion, context.costmap, goal, move.candidates, finds))


def _advance_clock(state: PlannerState, observation: Observation, params: PlannerParams) -> None:
    """Active time passes only while the inputs are fresh.

    A second of creeping takes as much of a goal's time as its way does at full speed: else a door
    behind a metre of floor that no camera saw is given up halfway.
    """
    last_s, state.last_step_s = state.last_step_s, observation.now_s
    if observation.stale_reason:
        if state.stale_since_s is None:
            state.stale_since_s = observation.now_s
        return
    passed_s = 0.0 if last_s is None else observation.now_s - last_s
    passed_s = min(passed_s, MAX_STEP_PERIOD_S)
    state.crept_s = state.crept_s + passed_s if observation.creeps else 0.0
    if observation.creeps:
        drive = params.drive
        state.give_more_time(passed_s * (1 - drive.unseen_mps / drive.max_linear_mps))
    state.stale_since_s = None
    state.active_time_s += passed_s


def _wait_for_inputs(state: PlannerState, observation: Observation) -> None:
    """Fail after ``PATIENCE_S`` without fresh inputs, later while a stage starts."""
    if state.stale_since_s is None:
        return
    waited_s = observation.now_s - state.stale_since_s
    patient_s = observation.now_s - max(state.stale_since_s, observation.patience_from_s)
    if patient_s > PATIENCE_S or waited_s > MAX_WAIT_S:
        reason = f"gave up after {waited_s:.0f} s ({observation.stale_reason})"
        _apply(state, _failed(reason, FailureCode.NO_INPUT), observation)


def _context(
    state: PlannerState,
    pose: Pose2d,
    observation: Observation,
    params: PlannerParams,
    window_xy: F64 | None,
) -> PlanningContext:
    view = observation.view
    assert view is not None
    zones = Zones(observation.places, state.search.stay_out)
    trail_xy = np.array(state.trail, np.float64).reshape(-1, 2)
    beside = BesideMap(trail_xy, state.obstacles_xy, zones)
    context = build_context(
        pose, view, params.costmap, beside, before=state.appeared, window_xy=window_xy
    )
    context = across_gaps(context) if state.crosses_gaps else context
    return replace(context, cost_to_go=context.cost_to_go.or_same(state.cost_to_go))


def _description(
    detail: Detail, observation: Observation, context: PlanningContext
) -> Description | None:
    """What is said of the object, on the whole map only; None if nothing is."""
    if detail == NO_DETAIL or not context.whole:
        return None
    views, places = observation.anchor_views, observation.places
    return described(detail, views, places, context.map_view, context.pose.xy)


def _take_in_map(state: PlannerState, observation: Observation, context: PlanningContext) -> None:
    """Take in the new detections; a map that was begun again resets what came from it."""
    known_m2, map_id = 0.0, ""
    if observation.view is not None:
        known_m2, map_id = known_area_m2(observation.view), observation.view.map_id
    begun_again = known_m2 < MAP_RESTART_FRACTION * state.known_m2
    if map_id and state.map_id:
        begun_again = map_id != state.map_id
    state.known_m2, state.map_id = known_m2, map_id
    if begun_again:
        state.forget_map()
        _apply(state, MapRestarted(), observation)
        return
    frames, target = observation.detections, state.search.target
    if context.whole:
        state.ledger.offer_changed(context.map_view)
        others = found_under_other_names(state.found_objects, target, state.synonyms)
        state.evidence.candidates = state.evidence.supported
        update_evidence(state, frames, context, others)
        sort_out(state, context)


def _run_phase(
    state: PlannerState, context: PlanningContext, turned_rad: float, exploration: Exploration
) -> tuple[Move, tuple[Event, ...]]:
    """What the present phase decides, and the events of the step."""
    move = Move()
    match state.search.phase:
        case Starting():
            seen_rad = radians(max(context.bands.camera.across_deg - OVERLAP_DEG, 0.0))
            move = Move(event=MapReady(context.known_fraction_around() < KNOWN_AROUND, seen_rad))
        case LookingAround():
            move = Move(Rotate(), select_candidate(state, context) or Rotated(turned_rad))
        case Exploring() if not context.whole:
            move = follow_goal(state, context)
        case Exploring():
            selected = select_candidate(state, context)
            move = Move(event=selected) if selected else exploration(state, context)
        case Approaching() as phase:
            move = approach(state, phase, context)
        case Confirming() as phase:
            move = confirm(state, phase, context)
        case Driving(destination):
            move = drive_to_place(state, destination, context)
    event = move.event
    exhausted = isinstance(event, Ending) and event.outcome is not SearchState.ARRIVED
    if exhausted and is_trapped(state, context.pose):
        event = stuck_failure(state)  # nothing was searched: no goal could be reached
    return move, () if event is None else (event,)


def _apply(state: PlannerState, event: Event, observation: Observation) -> None:
    """Take in the event; the next object begins without evidence."""
    xy = observation.pose.xy if observation.pose else None
    stamp = EventStamp(observation.now_s, state.active_time_s, xy, observation.odometer_m)
    if isinstance(event, Confirmed | Ending) and event.candidate is not None:
        state.find(event.candidate)
    search = transition(state.search, event, stamp)
    if search.index != state.search.index:
        state.begin_object()
    state.search = search


def check_progress(state: PlannerState, observation: Observation, params: PlannerParams) -> bool:
    """Update the progress monitor; whether the robot got stuck just now."""
    assert observation.pose is not None
    before, now_s = state.progress, state.active_time_s
    if before is None:
        state.progress = ProgressMonitor(observation.pose, now_s)
        return False
    sample = MotionSample(
        observation.pose, observation.command, observation.collided, now_s, observation.blocked
    )
    state.progress = before.update(sample, params.recovery)
    return state.progress.backing_from is not None and before.backing_from is None


def note_contact(state: PlannerState, observation: Observation, context: PlanningContext) -> None:
    """Put what the robot got stuck at by driving on the next costmaps, unless this one has it."""
    command = observation.command
    if state.progress is None or observation.blocked or command.speed_mps <= COMMANDED_MPS:
        return
    met_xy = met_at(context.pose, command, context.costmap, state.obstacles_xy)
    state.progress = state.progress.ran_into(met_xy, state.active_time_s)


def handle_stuck(state: PlannerState) -> tuple[Event, ...]:
    """Stuck ``MAX_STUCK_COUNT`` times in one place: give up the goal; twice as often: fail."""
    assert state.progress is not None
    stuck_count = state.progress.stuck_count
    if stuck_count >= 2 * MAX_STUCK_COUNT:
        return (stuck_failure(state),)
    return () if stuck_count % MAX_STUCK_COUNT else leave_goal(state)


def leave_goal(state: PlannerState, why: str = "") -> tuple[Event, ...]:
    """Give up the goal that cannot be driven to; why: a place, which is the only one, fails.

    Of a candidate the way failed: detected from elsewhere, it is taken up again.
    """
    match state.search.phase:
        case Approaching(candidate) | Confirming(candidate, _):
            latest = state.evidence.latest(candidate)
            if state.progress is not None:
                state.ledger.doubt(latest, state.progress.moved_at.xy)
            state.reject(latest)
            return (Rejected(),)
        case Driving() if why:
            return (_failed(why, FailureCode.UNREACHABLE),)
        case _ if state.active_goal is not None:
            state.give_up(state.active_goal.goal, reached=False)
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


def _failed(reason: str, code: FailureCode) -> Ending:
    return Ending(SearchState.FAILED, reason, code, whole=True)


def stuck_failure(state: PlannerState) -> Ending:
    """The event that ends the search of a robot that is stuck."""
    assert state.progress is not None
    x, y = state.progress.moved_at.xy
    return _failed(f"the robot is stuck at ({x:.1f}, {y:.1f})", FailureCode.STUCK)


def limit_reached(
    state: PlannerState, observation: Observation, limit_s: float = inf
) -> Event | None:
    """The event that ends the search, or the object, whose limit is reached; None without.

    limit_s: of one object; the search's own limits are in its budget, and count while it waits too.
    """
    search, budget = state.search, state.search.budget
    driven = driven_m(search, observation.odometer_m)
    if budget.max_distance_m and driven >= budget.max_distance_m:
        reason = f"drove {driven:.1f} m, and this search may drive {budget.max_distance_m:g} m"
        return _failed(reason, FailureCode.DISTANCE_LIMIT)
    if budget.max_time_s and elapsed_s(search, observation.now_s) >= budget.max_time_s:
        reason = f"not done within {budget.max_time_s:g} s, the limit for this search"
        return _failed(reason, FailureCode.TIME_LIMIT)
    if state.active_time_s - search.target_start.since_active_time_s > limit_s:
        missed = "not found" if search.target else "not reached"
        reason = f"{missed} within {limit_s:.0f} s, the limit for one object"
        return Ending(SearchState.FAILED, reason, FailureCode.TIME_LIMIT)
    return None
