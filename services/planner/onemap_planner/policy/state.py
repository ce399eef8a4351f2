"""State, observation and decision of a planning step, and the changes to the state."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from onemap_planner.motion.motions import Drive, Motion, Pose2d
from onemap_planner.motion.progress import ProgressMonitor
from onemap_planner.policy.competition import NO_SYNONYMS, FoundObject, Synonyms
from onemap_planner.policy.dead_ends import DeadEnd
from onemap_planner.policy.goals import Goal, GoalCandidates, GoalKind, LeftGoal
from onemap_planner.policy.order_params import OrderMemory
from onemap_planner.search.phases import Search
from onemap_planner.world.candidates import ConsensusParams, ObjectCandidate
from onemap_planner.world.costmap import NOTHING, Appeared, Costmap
from onemap_planner.world.map_view import PlanningView, WorldCells
from onemap_planner.world.regions import UndetectedViews
from onemap_shared.geometry import F64, Velocity2d
from onemap_shared.messages import Detections, ObjectFind
from onemap_shared.trail import extended

TRAIL_STEP_M = 0.1  # points closer together than this cover the same floor
MAX_LOOKS = 3  # views of one region or uncertain candidate, from different viewpoints
TRAIL_LENGTH = 5000  # points, 500 m


@dataclass(frozen=True, slots=True)
class GoalComparison:
    """When all goals were last compared, in seconds of active time, and among what.

    corners_xy (2, 2): lowest and highest x and y of the way to the chosen one, metres.
    """

    at_s: float
    corners_xy: F64
    candidates: GoalCandidates


@dataclass(frozen=True, slots=True)
class ActiveGoal:
    """The goal that the robot drives to. Seconds are active time; arrived_s None: on its way.

    budget_xy: where the goal was, in metres, when it got its budget of seconds. comparison: that
    it was chosen in; None: it is chosen anew in each step.
    """

    goal: Goal
    since_s: float
    budget_s: float
    budget_xy: tuple[float, float]
    arrived_s: float | None = None
    comparison: GoalComparison | None = None


@dataclass(frozen=True, slots=True)
class Doubt:
    """A place from which a candidate was not confirmed, and the candidate's, metres.

    A viewpoint of the candidate, or where the robot got stuck on the way to one.
    """

    from_xy: tuple[float, float]
    place_xyz: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class TargetState:
    """State of the search for the present object; the next object begins with an empty one.

    disputed: candidates that the map does not support. blacklisted: goals at regions and
    candidates that were viewed without result. idle_since_s:
    since when there has been no goal, or no viewpoint of the candidate, in active time; None:
    there is one. reconsidered: whether rejected candidates got their second chance already.
    refuted: similar cells that were searched before the object was put aside. left: the last
    goals that others were preferred to. doubts: viewpoints that did not confirm a candidate.
    undetected: similar cells in view, without a detection. closed_off: places, metres, of
    candidates that were left because no way led there, once for each time.
    """

    candidates: tuple[ObjectCandidate, ...] = ()
    disputed: tuple[ObjectCandidate, ...] = ()
    rejected: tuple[ObjectCandidate, ...] = ()
    blacklisted: tuple[Goal, ...] = ()
    active_goal: ActiveGoal | None = None
    idle_since_s: float | None = None
    reconsidered: bool = False
    refuted: WorldCells = frozenset()
    left: tuple[LeftGoal, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    undetected: UndetectedViews = field(default_factory=UndetectedViews)
    closed_off: tuple[tuple[float, float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class PlannerState:
    """State of the planner during one search.

    blacklisted_frontiers: frontiers that remained after a visit, kept for the whole search,
    because what could not be seen for one object cannot for the next, unless nothing else is
    left for it; unreached_frontiers: those of them that were given up on the way. crosses_gaps:
    paths may cross narrow gaps of unknown floor, because nothing else was left. trail: where the
    robot has been, metres. found_objects: of this search and those before on the same map;
    synonyms: of all these names. known_m2: known area at the last step. active_time_s: seconds with
    fresh inputs; last_step_s: time of the last step; stale_since_s: since when the inputs are
    stale, None while they are fresh; both of the planner's monotonic clock. dead_ends: the
    blacklisted places with what was around them. other_targets: what
    is known of objects, by their indices, that wait while others are sought; order_memory: where
    they may be. appeared: what has just appeared on the map.
    """

    search: Search
    target_state: TargetState = field(default_factory=TargetState)
    blacklisted_frontiers: tuple[tuple[float, float], ...] = ()
    unreached_frontiers: tuple[tuple[float, float], ...] = ()
    crosses_gaps: bool = False
    trail: tuple[tuple[float, float], ...] = ()
    progress: ProgressMonitor | None = None
    pose: Pose2d | None = None
    found_objects: tuple[FoundObject, ...] = ()
    synonyms: Synonyms = NO_SYNONYMS
    known_m2: float = 0.0
    active_time_s: float = 0.0
    last_step_s: float | None = None
    stale_since_s: float | None = None
    dead_ends: tuple[DeadEnd, ...] = ()
    other_targets: tuple[tuple[int, TargetState], ...] = ()
    order_memory: OrderMemory = field(default_factory=OrderMemory)
    appeared: Appeared = NOTHING

    @property
    def obstacles_xy(self) -> F64:
        """Virtual obstacles (B, 2), metres."""
        return self.progress.obstacles_xy if self.progress else np.zeros((0, 2))


@dataclass(frozen=True, slots=True)
class Observation:
    """Inputs of one planning step, at ``now_s`` of the planner's monotonic clock.

    pose None: no odometry yet; view None: the map has not answered; detections: all since the
    last step, oldest first; command: the velocity that the plan last asked for; stale_reason: why
    the inputs are too old to act on, empty if they are fresh; other_view: of the object of
    ``name_to_ask``; blocked: the costmap did not allow the command, so that the robot stands;
    creeps: it allowed only the speed over floor that no camera saw; patience_from_s: before then
    nobody could expect fresh inputs, because a stage was starting.
    """

    now_s: float
    pose: Pose2d | None
    odometer_m: float
    command: Velocity2d
    collided: bool
    view: PlanningView | None
    detections: tuple[Detections, ...]
    stale_reason: str
    other_view: PlanningView | None = None
    blocked: bool = False
    creeps: bool = False
    patience_from_s: float = float("-inf")


@dataclass(frozen=True, slots=True)
class Decision:
    """The motion until the next step, with the goal and what it was chosen from.

    finds: objects that this step confirmed, for the map to keep.
    """

    motion: Motion
    costmap: Costmap
    goal: Goal | None
    goal_candidates: GoalCandidates
    finds: tuple[ObjectFind, ...] = ()


def with_pose(state: PlannerState, pose: Pose2d) -> PlannerState:
    """The state at this pose, its trail extended."""
    trail = extended(state.trail, pose.xy, step_m=TRAIL_STEP_M, max_points=TRAIL_LENGTH)
    return replace(state, pose=pose, trail=trail)


def at_object(state: PlannerState, index: int, *, keep: bool) -> PlannerState:
    """The state with what is known of the object of this index; an object begins with nothing.

    keep: what is known of the present one, because it waits from now on.
    """
    targets = dict(state.other_targets)
    if keep:
        targets[state.search.index] = replace(
            state.target_state, active_goal=None, idle_since_s=None
        )
    target_state = targets.pop(index, TargetState())
    return replace(state, target_state=target_state, other_targets=tuple(targets.items()))


def with_more_time(state: PlannerState, more_s: float) -> PlannerState:
    """The state with ``more_s`` added to the time of the active goal, if there is one."""
    active_goal = state.target_state.active_goal
    if active_goal is None:
        return state
    active_goal = replace(active_goal, since_s=active_goal.since_s + more_s)
    return replace(state, target_state=replace(state.target_state, active_goal=active_goal))


def blacklist(state: PlannerState, goal: Goal, *, reached: bool = True) -> PlannerState:
    """The state with this goal, active or not, blacklisted; no goal is active.

    reached: whether the robot was there, or gave it up on its way.
    """
    target_state = replace(state.target_state, active_goal=None)
    if goal.kind is GoalKind.FRONTIER:
        unreached = () if reached else (goal.look_xy,)
        return replace(
            state,
            target_state=target_state,
            blacklisted_frontiers=(*state.blacklisted_frontiers, goal.look_xy),
            unreached_frontiers=(*state.unreached_frontiers, *unreached),
        )
    return replace(
        state, target_state=replace(target_state, blacklisted=(*target_state.blacklisted, goal))
    )


def abandon_finished(state: PlannerState, linger_s: float) -> PlannerState:
    """Blacklist the active goal if it was viewed for ``linger_s`` or its time is over."""
    active_goal = state.target_state.active_goal
    if active_goal is None:
        return state
    visited = (
        active_goal.arrived_s is not None
        and state.active_time_s - active_goal.arrived_s >= linger_s
    )
    late = state.active_time_s - active_goal.since_s > active_goal.budget_s
    return blacklist(state, active_goal.goal, reached=visited) if visited or late else state


def compared(
    active_goal: ActiveGoal, motion: Drive, now_s: float, candidates: GoalCandidates
) -> ActiveGoal:
    """The goal with the comparison that it was chosen in."""
    way = motion.points_xy
    corners_xy = np.stack([way.min(axis=0), way.max(axis=0)])
    return replace(active_goal, comparison=GoalComparison(now_s, corners_xy, candidates))


def is_new_goal(state: PlannerState, active_goal: ActiveGoal) -> bool:
    """Whether a goal was chosen anew: not the one that is active, as the map shows it now."""
    before = state.target_state.active_goal
    return before is None or before.since_s != active_goal.since_s


def reconsider(
    state: PlannerState, *, frontiers: bool, doubtful: tuple[ObjectCandidate, ...] = ()
) -> PlannerState:
    """The state that considers rejected candidates once more, because no goal is left.

    doubtful: those that the map does not support and that are worth a look from another side;
    what was seen of them counts on. All others are forgotten until they are detected again.
    Frontiers that were given up on the way are offered again. frontiers: also those that stayed
    after their visit, since one of them may be the way to a part of the flat that noise cut off.
    """
    unreached = state.unreached_frontiers
    visited = tuple(xy for xy in state.blacklisted_frontiers if xy not in unreached)
    return replace(
        state,
        target_state=TargetState(reconsidered=True, disputed=doubtful),
        blacklisted_frontiers=() if frontiers else visited,
        unreached_frontiers=(),
    )


def is_blacklisted(state: PlannerState, goal: Goal, within_m: float) -> bool:
    """Whether enough goals of its kind were blacklisted ``within_m`` of it.

    One visit decides about a frontier; an object may be visible from another viewpoint.
    """
    if goal.kind is GoalKind.FRONTIER:
        return any(goal.looks_at(xy, within_m) for xy in state.blacklisted_frontiers)
    tries = [
        gone
        for gone in state.target_state.blacklisted
        if gone.kind is goal.kind and goal.looks_at(gone.look_xy, within_m)
    ]
    return len(tries) >= MAX_LOOKS


def latest_candidate(
    state: PlannerState, candidate: ObjectCandidate, params: ConsensusParams
) -> ObjectCandidate:
    """The candidate as it is known now: on common cells, else within ``merge_m``, else as given."""
    target_state = state.target_state
    all_known = target_state.candidates if candidate.supported else target_state.disputed
    for known in all_known:
        if not known.cells.isdisjoint(candidate.cells):
            return known
    near = [c for c in all_known if c.distance_m(candidate.xyz) <= params.merge_m]
    return near[0] if near else candidate


def with_doubt(
    state: PlannerState, candidate: ObjectCandidate, from_xy: tuple[float, float]
) -> PlannerState:
    """The state in which the candidate could not be confirmed from this place, in metres."""
    doubts = (*state.target_state.doubts, Doubt(from_xy, candidate.xyz))
    return replace(state, target_state=replace(state.target_state, doubts=doubts))


def reject_candidate(state: PlannerState, candidate: ObjectCandidate) -> PlannerState:
    """The state without the candidate; new sightings of it are ignored.

    A candidate with the map's support and one without it are rejected each by itself.
    """
    target_state = state.target_state
    candidates, disputed = target_state.candidates, target_state.disputed
    if candidate.supported:
        candidates = tuple(c for c in candidates if c.cells.isdisjoint(candidate.cells))
    else:
        disputed = tuple(c for c in disputed if c.cells.isdisjoint(candidate.cells))
    return replace(
        state,
        target_state=replace(
            target_state,
            candidates=candidates,
            disputed=disputed,
            rejected=(*target_state.rejected, candidate),
            idle_since_s=None,
        ),
    )
