"""What the planner keeps in mind from one plan to the next."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from onemap_planner.motion.progress import Footing
from onemap_planner.motion.pure_pursuit import Pose
from onemap_planner.policy.competition import NO_SYNONYMS, Claim, Synonyms
from onemap_planner.policy.goals import Goal, GoalKind
from onemap_planner.search.phases import Search
from onemap_planner.world.candidates import Candidate

TRAIL_STEP_M = 0.1  # places closer together than this cover the same floor
MAX_LOOKS = 3  # at one region or doubtful sighting, from different stands
TRAIL_LENGTH = 5000  # 500 m of way


@dataclass(frozen=True, slots=True)
class Pursuit:
    """A goal being pursued. Seconds are attentive seconds; ``arrived_s`` None: under way."""

    goal: Goal
    since_s: float
    budget_s: float
    arrived_s: float | None = None


@dataclass(frozen=True, slots=True)
class Quest:
    """What belongs to the present object; a new object gets a new one.

    shunned: goals at regions and sightings that came to nothing. idle_since_s: since when
    there has been no goal, or no stand before the candidate; None: there is one.
    reconsidered: whether everything was searched before, and what was rejected forgiven.
    """

    candidates: tuple[Candidate, ...] = ()
    rejected: tuple[Candidate, ...] = ()
    shunned: tuple[Goal, ...] = ()
    pursuit: Pursuit | None = None
    idle_since_s: float | None = None
    reconsidered: bool = False


@dataclass(frozen=True, slots=True)
class Mind:
    """All the planner remembers during one search.

    trail: where the robot has been, metres; claims: what was found, in this search and those
    before on the same map, and where; synonyms: of all these names; dead_ends: frontiers that
    stayed after a visit, kept for the whole search, since what could not be seen for one object
    cannot for the next.
    attentive_s: seconds in which the senses were fresh; thought_s: when it last thought;
    stale_since_s: since when the senses are not fresh, None when they are.
    """

    search: Search
    quest: Quest = field(default_factory=Quest)
    dead_ends: tuple[tuple[float, float], ...] = ()
    trail: tuple[tuple[float, float], ...] = ()
    footing: Footing | None = None
    pose: Pose | None = None
    claims: tuple[Claim, ...] = ()
    synonyms: Synonyms = NO_SYNONYMS
    known_m2: float = 0.0
    attentive_s: float = 0.0
    thought_s: float | None = None
    stale_since_s: float | None = None


def walked(mind: Mind, pose: Pose) -> Mind:
    """The mind with the pose taken in."""
    if mind.trail and pose.distance_to(mind.trail[-1]) < TRAIL_STEP_M:
        return replace(mind, pose=pose)
    return replace(mind, pose=pose, trail=(*mind.trail[-TRAIL_LENGTH:], pose.xy))


def shun(mind: Mind, goal: Goal) -> Mind:
    """The mind with this goal left alone from now on."""
    quest = replace(mind.quest, pursuit=None)
    if goal.kind is GoalKind.FRONTIER:
        return replace(mind, quest=quest, dead_ends=(*mind.dead_ends, goal.look_xy))
    return replace(mind, quest=replace(quest, shunned=(*quest.shunned, goal)))


def reconsider(mind: Mind) -> Mind:
    """The mind that gives what it rejected one more chance, when nothing better is left."""
    return replace(mind, quest=Quest(reconsidered=True))


def is_shunned(mind: Mind, goal: Goal, within_m: float) -> bool:
    """Whether enough goals of its kind came to nothing there.

    A border either goes away or it does not; what is looked at may show from another side.
    """
    if goal.kind is GoalKind.FRONTIER:
        return any(goal.is_about(xy, within_m) for xy in mind.dead_ends)
    tries = [
        gone
        for gone in mind.quest.shunned
        if gone.kind is goal.kind and goal.is_about(gone.look_xy, within_m)
    ]
    return len(tries) >= MAX_LOOKS
