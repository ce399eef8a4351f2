"""State of the planner: the search, the evidence about its object, what was tried, the robot.

A step works on a copy, which its functions change; the state that it was given stays as it is.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import dist, nan

import numpy as np

from onemap_planner.motion.motions import Drive, Pose2d
from onemap_planner.motion.path import CostToGo
from onemap_planner.motion.progress import ProgressMonitor
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import Goal, SearchAreas
from onemap_planner.policy.ledger import Ledger, Xy
from onemap_planner.search import state_machine as sm
from onemap_planner.sentences import Landmarks
from onemap_planner.world.appeared import NOTHING, Appeared
from onemap_planner.world.candidates import MERGE_M, MIN_SIGHTINGS, ObjectCandidate
from onemap_planner.world.map_view import WorldCells
from onemap_shared.geometry import F64
from onemap_shared.trail import extended

LINGER_S = 1.0  # seconds at a goal, so that the map fuses it; it is given up afterwards
# Seconds without any goal before the robot looks around for one; without one after that the object
# counts as not found.
SETTLE_S = 2.0
GOAL_BASE_S = 15.0  # seconds allowed for any goal, turning included
GOAL_S_PER_M = 5.0  # seconds allowed per metre of path: three times a slow drive
TRAIL_STEP_M = 0.1  # points closer together than this cover the same floor
TRAIL_LENGTH = 5000  # points, 500 m
MAX_FOUND_OBJECTS = 64  # the newest are kept


@dataclass(frozen=True, slots=True)
class FoundObject:
    """A confirmed object: its name, the world cells that supported it, and the height of its
    middle in metres, NaN: not known."""

    name: str
    cells: WorldCells
    height_m: float = nan


# Pairs of normalised names that mean the same and therefore do not compete.
Synonyms = frozenset[frozenset[str]]
NO_SYNONYMS: Synonyms = frozenset()


@dataclass(frozen=True, slots=True)
class GoalComparison:
    """When all goals were last compared, in seconds of active time, and the areas then.

    corners_xy (2, 2): lowest and highest x and y of the way to the chosen one, metres.
    """

    at_s: float
    corners_xy: F64
    areas: SearchAreas


@dataclass(frozen=True, slots=True)
class ActiveGoal:
    """The goal that the robot drives to. Seconds are active time; arrived_s None: on its way.

    budget_xy: where the goal was, in metres, when it got its budget of seconds. comparison: that
    it was chosen in; None: it is chosen anew in each step.
    """

    goal: Goal
    since_s: float
    budget_s: float
    budget_xy: Xy
    arrived_s: float | None = None
    comparison: GoalComparison | None = None

    def at(self, now_s: float, *, arrived: bool) -> ActiveGoal:
        """The goal now; if the robot is there, from now on unless it was before."""
        if not arrived or self.arrived_s is not None:
            return self
        return replace(self, arrived_s=now_s)

    def compared(self, motion: Drive, areas: SearchAreas, now_s: float) -> ActiveGoal:
        """The goal with the comparison that it was chosen in."""
        way = motion.points_xy
        corners_xy = np.stack([way.min(axis=0), way.max(axis=0)])
        return replace(self, comparison=GoalComparison(now_s, corners_xy, areas))


@dataclass(slots=True)
class Evidence:
    """What is known of the present object.

    candidates: those that detector and map agree on; unsupported: those that the map does not
    support; rejected: of both, those that are not the object, or cannot be reached. Of an object
    that is described, candidates are sorted out: unclear ones, of which it cannot be told yet
    whether they are as described, and mismatched ones, which are not. other_finds: those that were
    confirmed, but are not as described; takes_any: whether the search takes any object of the
    name, to say that it is another one. anchors: candidates of the other things that its
    description names, by name.
    """

    candidates: tuple[ObjectCandidate, ...] = ()
    unsupported: tuple[ObjectCandidate, ...] = ()
    rejected: tuple[ObjectCandidate, ...] = ()
    unclear: tuple[ObjectCandidate, ...] = ()
    mismatched: tuple[ObjectCandidate, ...] = ()
    other_finds: tuple[ObjectCandidate, ...] = ()
    takes_any: bool = False
    anchors: dict[str, tuple[ObjectCandidate, ...]] = field(default_factory=dict)

    def copy(self) -> Evidence:
        """Evidence that changes apart from this one."""
        return replace(self, anchors=dict(self.anchors))

    @property
    def supported(self) -> tuple[ObjectCandidate, ...]:
        """All candidates that the map supports, whatever is described."""
        return (*self.candidates, *self.unclear, *self.mismatched)

    def latest(self, candidate: ObjectCandidate) -> ObjectCandidate:
        """It as it is known now: on common cells, else within ``MERGE_M``, else as given."""
        known = self.supported if candidate.supported else self.unsupported
        for other in known:
            if not other.cells.isdisjoint(candidate.cells):
                return other
        near = [c for c in known if c.distance_m(candidate.xyz) <= MERGE_M]
        return near[0] if near else candidate

    def reject(self, candidate: ObjectCandidate) -> None:
        """Remove the candidate; new sightings of it are ignored.

        One with the map's support and one without it are rejected each by itself.
        """
        if candidate.supported:
            self.candidates = _without(self.candidates, candidate)
        else:
            self.unsupported = _without(self.unsupported, candidate)
        self.rejected = (*self.rejected, candidate)

    def is_mismatched(self, candidate: ObjectCandidate) -> bool:
        """Whether it, as it is known now, is not as described."""
        return any(each is candidate for each in self.mismatched)


def _without(
    candidates: tuple[ObjectCandidate, ...], rejected: ObjectCandidate
) -> tuple[ObjectCandidate, ...]:
    return tuple(c for c in candidates if c.cells.isdisjoint(rejected.cells))


@dataclass(frozen=True, slots=True)
class Displacement:
    """Of a robot that was moved: why it stands, in words, until which second of active time, and
    whether its pose does not tell of it."""

    why: str
    until_s: float
    unnoticed: bool


@dataclass(slots=True)
class PlannerState:
    """State of the planner during one search.

    evidence: about the present object. ledger: what was tried. active_goal: where the robot
    drives. idle_since_s: active time since when there has been no goal, or no viewpoint of the
    candidate; None: there is one. reconsidered: whether what was rejected got its second chance for
    this object. found_objects: of this search and those before on the same map; synonyms: of all
    these names. map_id and known_m2: of the map at the last step, the latter its known area.
    active_time_s: seconds with fresh inputs; last_step_s: time of the last step; stale_since_s:
    since when the inputs are stale, None while they are fresh; both of the planner's monotonic
    clock. pose and pose_ns: of the last step with fresh inputs, the time on the robot's clock, 0 if
    unknown. trail: where the robot has been, metres. crept_s: active time for which it has crept
    without a break. appeared: what has just appeared on the map. cost_to_go: of the last step, for
    one on the same map from the same place. displacement: while the robot stands because it was
    moved. refused: the last goal at which the robot's own navigation failed.
    """

    search: sm.Search
    evidence: Evidence = field(default_factory=Evidence)
    ledger: Ledger = field(default_factory=Ledger)
    active_goal: ActiveGoal | None = None
    idle_since_s: float | None = None
    reconsidered: bool = False
    found_objects: tuple[FoundObject, ...] = ()
    synonyms: Synonyms = NO_SYNONYMS
    map_id: str = ""
    known_m2: float = 0.0
    active_time_s: float = 0.0
    last_step_s: float | None = None
    stale_since_s: float | None = None
    trail: tuple[Xy, ...] = ()
    progress: ProgressMonitor | None = None
    pose: Pose2d | None = None
    pose_ns: int = 0
    crept_s: float = 0.0
    appeared: Appeared = NOTHING
    cost_to_go: CostToGo | None = None
    displacement: Displacement | None = None
    refused: Pose2d | None = None

    def copy(self) -> PlannerState:
        """A state that changes apart from this one."""
        return replace(self, evidence=self.evidence.copy(), ledger=replace(self.ledger))

    @property
    def obstacles_xy(self) -> F64:
        """Virtual obstacles (B, 2), metres."""
        return self.progress.obstacles_xy if self.progress else np.zeros((0, 2))

    def apply(self, event: sm.Event, stamp: sm.EventStamp) -> None:
        """Take in the event; the next object begins without evidence.

        While a candidate is approached the goal before it is none, nor does its time run.
        """
        if (found := sm.found_by(event)) is not None:
            self.find(found)
        if isinstance(event, sm.CandidateSelected):
            self.active_goal = None
        search = sm.transition(self.search, event, stamp)
        if search.index != self.search.index:
            self.begin_object()
        self.search = search

    def move_to(self, pose: Pose2d) -> None:
        """The robot is here: its trail grows."""
        self.pose = pose
        self.trail = extended(self.trail, pose.xy, step_m=TRAIL_STEP_M, max_points=TRAIL_LENGTH)

    def begin_object(self) -> None:
        """Forget what belongs to one object only."""
        self.evidence = Evidence()
        self.ledger.forget_looks()
        self.active_goal, self.idle_since_s, self.reconsidered = None, None, False

    def forget_map(self) -> None:
        """The map was begun again: forget what came from it."""
        self.begin_object()
        self.ledger = Ledger()
        self.found_objects = ()

    def find(self, candidate: ObjectCandidate) -> None:
        """Remember a candidate just confirmed as the present object."""
        found = FoundObject(self.search.target, candidate.cells, candidate.xyz[2])
        self.found_objects = (*self.found_objects, found)[-MAX_FOUND_OBJECTS:]

    def landmarks(self, context: PlanningContext) -> Landmarks:
        """By what places are described now: the robot, what was found, and the anchors seen."""
        pose, size_m = context.pose, context.map_view.grid.cell_size_m
        things = [
            (name, anchor.xyz[:2])
            for name, seen in self.evidence.anchors.items()
            for anchor in seen
            if anchor.sightings >= MIN_SIGHTINGS
        ]
        for found in self.found_objects:
            x, y = (np.mean(sorted(found.cells), axis=0) + 0.5) * size_m
            things.append((found.name, (float(x), float(y))))
        return Landmarks(pose.xy, pose.yaw_rad, tuple(things))

    def idle_s(self) -> float:
        """For how long there has been no goal, or no viewpoint of the candidate: from now on if
        there was one before."""
        if self.idle_since_s is None:
            self.idle_since_s = self.active_time_s
        return self.active_time_s - self.idle_since_s

    def reject(self, candidate: ObjectCandidate, why: str) -> None:
        """It is not the object, or cannot be reached; why: in words, for those who wait."""
        self.evidence.reject(candidate)
        self.idle_since_s = None
        if self.evidence.takes_any:  # it is known already not to be as described
            here = [
                p for p in self.search.passed if dist(p.position_m, candidate.xyz[:2]) <= MERGE_M
            ]
            why = "; ".join(dict.fromkeys([*(each.reason for each in here), why]))
        self.pass_by(candidate, why)

    def pass_by(self, candidate: ObjectCandidate, why: str = "") -> None:
        """Tell why a candidate is left aside; without a reason, that it is not."""
        self.search = sm.passed_by(self.search, candidate.xyz[:2], why)

    def new_goal(self, goal: Goal) -> ActiveGoal:
        """A goal that is taken up now."""
        budget_s = GOAL_BASE_S + GOAL_S_PER_M * goal.utility.travel_m
        return ActiveGoal(goal, self.active_time_s, budget_s, goal.look_xy)

    def is_new(self, goal: ActiveGoal) -> bool:
        """Whether a goal was chosen anew: not the active one, as the map shows it now."""
        return self.active_goal is None or self.active_goal.since_s != goal.since_s

    def give_more_time(self, more_s: float) -> None:
        """Add to the time of the active goal, if there is one."""
        goal = self.active_goal
        if goal is not None:
            self.active_goal = replace(goal, since_s=goal.since_s + more_s)

    def give_up(self, goal: Goal) -> None:
        """Do not take this goal, active or not, again; no goal is active."""
        self.active_goal = None
        self.ledger.give_up(goal)

    def give_up_finished(self) -> None:
        """Give up the active goal if it was viewed for ``LINGER_S`` or its time is over."""
        active, now_s = self.active_goal, self.active_time_s
        if active is None:
            return
        visited = active.arrived_s is not None and now_s - active.arrived_s >= LINGER_S
        if visited or now_s - active.since_s > active.budget_s:
            self.give_up(active.goal)

    def reconsider(self, against_map: tuple[ObjectCandidate, ...] = ()) -> None:
        """Offer once more what was tried, because no goal is left.

        against_map: candidates that the map does not support and that are worth a look from another
        side; what was seen of them counts on. Other rejected ones are forgotten until they are
        detected again.
        """
        self.evidence = replace(
            self.evidence, candidates=(), unsupported=against_map, rejected=(), takes_any=False
        )
        self.ledger = Ledger()
        self.active_goal, self.idle_since_s, self.reconsidered = None, None, True
