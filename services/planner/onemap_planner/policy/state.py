"""What the planner keeps in mind from one plan to the next."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from onemap_planner.motion.motions import Motion, Pose2d
from onemap_planner.motion.progress import ProgressMonitor
from onemap_planner.policy.competition import NO_SYNONYMS, FoundObject, Synonyms
from onemap_planner.policy.goals import Goal, GoalCandidates, GoalKind
from onemap_planner.search.phases import Search
from onemap_planner.world.candidates import ConsensusParams, ObjectCandidate
from onemap_planner.world.costmap import Costmap
from onemap_shared.geometry import F64, Velocity2d
from onemap_shared.messages import Detections, SearchView
from onemap_shared.trail import extended

TRAIL_STEP_M = 0.1  # places closer together than this cover the same floor
MAX_LOOKS = 3  # at one region or doubtful sighting, from different stands
TRAIL_LENGTH = 5000  # 500 m of way


@dataclass(frozen=True, slots=True)
class ActiveGoal:
    """A goal being pursued. Seconds are attentive seconds; ``arrived_s`` None: under way."""

    goal: Goal
    since_s: float
    budget_s: float
    arrived_s: float | None = None


@dataclass(frozen=True, slots=True)
class TargetState:
    """What belongs to the present object; a new object gets a new one.

    shunned: goals at regions and sightings that came to nothing. idle_since_s: since when
    there has been no goal, or no stand before the candidate; None: there is one.
    reconsidered: whether everything was searched before, and what was rejected forgiven.
    """

    candidates: tuple[ObjectCandidate, ...] = ()
    rejected: tuple[ObjectCandidate, ...] = ()
    blacklisted: tuple[Goal, ...] = ()
    active_goal: ActiveGoal | None = None
    idle_since_s: float | None = None
    reconsidered: bool = False


@dataclass(frozen=True, slots=True)
class PlannerState:
    """All the planner remembers during one search.

    trail: where the robot has been, metres; claims: what was found, in this search and those
    before on the same map, and where; synonyms: of all these names;
    blacklisted_frontiers: frontiers that stayed after a visit, kept for the whole
    search, since what could not be seen for one object cannot for the next.
    active_time_s: seconds in which the senses were fresh; last_step_s: when it last thought;
    stale_since_s: since when the senses are not fresh, None when they are.
    """

    search: Search
    target_state: TargetState = field(default_factory=TargetState)
    blacklisted_frontiers: tuple[tuple[float, float], ...] = ()
    trail: tuple[tuple[float, float], ...] = ()
    progress: ProgressMonitor | None = None
    pose: Pose2d | None = None
    found_objects: tuple[FoundObject, ...] = ()
    synonyms: Synonyms = NO_SYNONYMS
    known_m2: float = 0.0
    active_time_s: float = 0.0
    last_step_s: float | None = None
    stale_since_s: float | None = None

    @property
    def obstacles_xy(self) -> F64:
        """Virtual obstacles (B, 2), metres."""
        return self.progress.obstacles_xy if self.progress else np.zeros((0, 2))


@dataclass(frozen=True, slots=True)
class Observation:
    """What is known at the time of a thought.

    pose None: no odometry yet; view None: the map has not answered. detections: all that
    came since the last thought, oldest first. command: the velocity last sent. complaint:
    why the senses are not to be trusted now; empty if they are.
    """

    now_s: float
    pose: Pose2d | None
    odometer_m: float
    command: Velocity2d
    collided: bool
    view: SearchView | None
    detections: tuple[Detections, ...]
    stale_reason: str


@dataclass(frozen=True, slots=True)
class Decision:
    """What to do until the next thought, and what led to it."""

    motion: Motion
    costmap: Costmap
    goal: Goal | None
    goal_candidates: GoalCandidates


def with_pose(state: PlannerState, pose: Pose2d) -> PlannerState:
    """The state at this pose, its trail extended."""
    trail = extended(state.trail, pose.xy, step_m=TRAIL_STEP_M, max_points=TRAIL_LENGTH)
    return replace(state, pose=pose, trail=trail)


def blacklist(state: PlannerState, goal: Goal) -> PlannerState:
    """The mind with this goal left alone from now on."""
    target_state = replace(state.target_state, active_goal=None)
    if goal.kind is GoalKind.FRONTIER:
        return replace(
            state,
            target_state=target_state,
            blacklisted_frontiers=(*state.blacklisted_frontiers, goal.look_xy),
        )
    return replace(
        state, target_state=replace(target_state, blacklisted=(*target_state.blacklisted, goal))
    )


def reconsider(state: PlannerState) -> PlannerState:
    """The mind that gives what it rejected one more chance, when nothing better is left."""
    return replace(state, target_state=TargetState(reconsidered=True))


def is_blacklisted(state: PlannerState, goal: Goal, within_m: float) -> bool:
    """Whether enough goals of its kind came to nothing there.

    A border either goes away or it does not; what is looked at may show from another side.
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
    """What has become of the candidate: the remembered one at the same place."""
    for known in state.target_state.candidates:
        if not known.cells.isdisjoint(candidate.cells):
            return known
    near = [
        c for c in state.target_state.candidates if c.distance_m(candidate.xyz) <= params.merge_m
    ]
    return near[0] if near else candidate


def reject_candidate(state: PlannerState, candidate: ObjectCandidate) -> PlannerState:
    """The mind that no longer believes in the candidate, nor in new sightings of it."""
    target_state = state.target_state
    left = tuple(c for c in target_state.candidates if c.cells.isdisjoint(candidate.cells))
    return replace(
        state,
        target_state=replace(
            target_state,
            candidates=left,
            rejected=(*target_state.rejected, candidate),
            idle_since_s=None,
        ),
    )
