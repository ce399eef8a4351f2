"""What the planner keeps in mind from one plan to the next."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.progress import ProgressMonitor
from onemap_planner.policy.competition import NO_SYNONYMS, FoundObject, Synonyms
from onemap_planner.policy.goals import Goal, GoalKind
from onemap_planner.search.phases import Search
from onemap_planner.world.candidates import ObjectCandidate

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


def with_pose(state: PlannerState, pose: Pose2d) -> PlannerState:
    """The mind with the pose taken in."""
    if state.trail and pose.distance_to(state.trail[-1]) < TRAIL_STEP_M:
        return replace(state, pose=pose)
    return replace(state, pose=pose, trail=(*state.trail[-TRAIL_LENGTH:], pose.xy))


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
