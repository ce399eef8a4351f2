"""What a search remembers: of its present object, of the goals given up, of where the robot was.

A step works on its own copy and changes it by these methods; the state that it was given stays as
it is.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from onemap_planner.motion.motions import Drive, Pose2d
from onemap_planner.motion.path import CostToGo
from onemap_planner.motion.progress import ProgressMonitor
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import (
    GIVEN_UP_RADIUS_M,
    SAME_GOAL_M,
    Goal,
    GoalCandidates,
    GoalKind,
    successor,
)
from onemap_planner.policy.viewpoints import find_viewpoint
from onemap_planner.search.state_machine import Search
from onemap_planner.sentences import Landmarks
from onemap_planner.world.candidates import (
    MERGE_M,
    MIN_SIGHTINGS,
    VIEWS_PER_VIEWPOINT,
    ObjectCandidate,
)
from onemap_planner.world.costmap import NOTHING, Appeared
from onemap_planner.world.map_view import MapView, WorldCells
from onemap_planner.world.regions import UndetectedViews
from onemap_shared.geometry import F64, U8
from onemap_shared.messages import Occupancy
from onemap_shared.trail import extended

LINGER_S = 1.0  # seconds at a goal, so that the map fuses it; it is given up afterwards
# Seconds without any goal before the robot looks around for one; without one after that the object
# counts as not found.
SETTLE_S = 2.0
GOAL_BASE_S = 15.0  # seconds allowed for any goal, turning included
GOAL_S_PER_M = 5.0  # seconds allowed per metre of path: three times a slow drive
MAX_LEFT = 8  # goals that were left; more do not take turns
RETURN_PART = 1 / 3  # of a goal's base time: one that comes and goes has three visits
MAX_LOOKS = 3  # views of one region or uncertain candidate, from different viewpoints
TRAIL_STEP_M = 0.1  # points closer together than this cover the same floor
TRAIL_LENGTH = 5000  # points, 500 m
MAX_FOUND_OBJECTS = 64  # the newest are kept
DEAD_END_AROUND_M = 1.0  # metres around a goal, on all sides, in which changes count: a door
# Square metres that have become free or occupied: half a person; noise at the rims of furniture
# changes less.
DEAD_END_CHANGED_M2 = 0.3
# How often one place is offered again in a search, also a candidate to which the way was closed:
# people who walk through a room change it all the time.
DEAD_END_RETURNS = 2

Xy = tuple[float, float]


@dataclass(frozen=True, slots=True)
class FoundObject:
    """A confirmed object: its name and the world cells that supported it."""

    name: str
    cells: WorldCells


# Pairs of normalised names that mean the same and therefore do not compete.
Synonyms = frozenset[frozenset[str]]
NO_SYNONYMS: Synonyms = frozenset()


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
    budget_xy: Xy
    arrived_s: float | None = None
    comparison: GoalComparison | None = None

    def at(self, now_s: float, *, arrived: bool) -> ActiveGoal:
        """The goal now; if the robot is there, from now on unless it was before."""
        if not arrived or self.arrived_s is not None:
            return self
        return replace(self, arrived_s=now_s)

    def compared(self, motion: Drive, candidates: GoalCandidates, now_s: float) -> ActiveGoal:
        """The goal with the comparison that it was chosen in."""
        way = motion.points_xy
        corners_xy = np.stack([way.min(axis=0), way.max(axis=0)])
        return replace(self, comparison=GoalComparison(now_s, corners_xy, candidates))


@dataclass(frozen=True, slots=True)
class LeftGoal:
    """A goal that another one was preferred to, and the seconds that were spent on it."""

    goal: Goal
    spent_s: float

    def is_about(self, goal: Goal) -> bool:
        """Whether another goal is about the same."""
        return self.goal.kind is goal.kind and self.goal.looks_at(goal.look_xy, SAME_GOAL_M)


@dataclass(frozen=True, slots=True)
class Doubt:
    """A place from which a candidate was not confirmed, and the candidate's, metres.

    A viewpoint of the candidate, or where the robot got stuck on the way to one.
    """

    from_xy: Xy
    place_xyz: tuple[float, float, float]


@dataclass(slots=True)
class TargetMemory:
    """What is remembered of one object; the next one begins with an empty memory.

    disputed: candidates that the map does not support. given_up: goals at regions and candidates
    that were viewed without result. idle_since_s: since when there has been no goal, or no
    viewpoint of the candidate, in active time; None: there is one. reconsidered: whether rejected
    candidates got their second chance already. left: the last goals that others were preferred to.
    doubts: viewpoints that did not confirm a candidate. undetected: similar cells in view, without
    a detection. closed_off: places, metres, of candidates that were left because no way led there,
    once for each time. undecided and aside: candidates of which it cannot be told yet whether they
    are as described, and which are not; others: those that were confirmed all the same; settles:
    whether the search takes any object of the name, to say that it is another one. anchors:
    candidates of the other things that its description names, by name.
    """

    candidates: tuple[ObjectCandidate, ...] = ()
    disputed: tuple[ObjectCandidate, ...] = ()
    rejected: tuple[ObjectCandidate, ...] = ()
    given_up: tuple[Goal, ...] = ()
    active_goal: ActiveGoal | None = None
    idle_since_s: float | None = None
    reconsidered: bool = False
    left: tuple[LeftGoal, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    undetected: UndetectedViews = field(default_factory=UndetectedViews)
    closed_off: tuple[tuple[float, float, float], ...] = ()
    undecided: tuple[ObjectCandidate, ...] = ()
    aside: tuple[ObjectCandidate, ...] = ()
    others: tuple[ObjectCandidate, ...] = ()
    settles: bool = False
    anchors: dict[str, tuple[ObjectCandidate, ...]] = field(default_factory=dict)

    def copy(self) -> TargetMemory:
        """A memory that changes apart from this one."""
        return replace(self, anchors=dict(self.anchors))

    def latest(self, candidate: ObjectCandidate) -> ObjectCandidate:
        """It as it is known now: on common cells, else within ``MERGE_M``, else as given."""
        named = (*self.candidates, *self.undecided, *self.aside)
        known = named if candidate.supported else self.disputed
        for other in known:
            if not other.cells.isdisjoint(candidate.cells):
                return other
        near = [c for c in known if c.distance_m(candidate.xyz) <= MERGE_M]
        return near[0] if near else candidate

    def doubt(self, candidate: ObjectCandidate, from_xy: Xy) -> None:
        """The candidate could not be confirmed from this place, in metres."""
        self.doubts = (*self.doubts, Doubt(from_xy, candidate.xyz))

    def reject(self, candidate: ObjectCandidate) -> None:
        """Remove the candidate; new sightings of it are ignored.

        One with the map's support and one without it are rejected each by itself.
        """
        if candidate.supported:
            self.candidates = _without(self.candidates, candidate)
        else:
            self.disputed = _without(self.disputed, candidate)
        self.rejected = (*self.rejected, candidate)
        self.idle_since_s = None

    def is_aside(self, candidate: ObjectCandidate) -> bool:
        """Whether it, as it is known now, is not as described."""
        return any(each is candidate for each in self.aside)

    def doubted_from(self, candidate: ObjectCandidate) -> list[Xy]:
        """Viewpoints, metres, from which the candidate was not confirmed."""
        return [d.from_xy for d in self.doubts if candidate.distance_m(d.place_xyz) <= MERGE_M]

    def next_viewpoint(self, candidate: ObjectCandidate, context: PlanningContext) -> Xy | None:
        """The viewpoint (metres) of a candidate that was not tried; None if none can be reached."""
        looked_from = [
            goal.viewpoint_xy
            for goal in self.given_up
            if goal.kind is GoalKind.DETECTION and goal.looks_at(candidate.xyz[:2], MERGE_M)
        ]
        tried = [*exhausted_viewpoints(candidate), *self.doubted_from(candidate), *looked_from]
        return find_viewpoint(candidate, context, tried)

    def tried_xy(self, kind: GoalKind) -> F64:
        """Viewpoints (T, 2), metres, of the goals of this kind that were given up."""
        tried = [goal.viewpoint_xy for goal in self.given_up if goal.kind is kind]
        return np.array(tried, np.float64).reshape(-1, 2)

    def idle_from_s(self, now_s: float) -> float:
        """Since when there is no goal, or no viewpoint of the candidate: since now at least."""
        if self.idle_since_s is None:
            self.idle_since_s = now_s
        return self.idle_since_s

    def is_new(self, goal: ActiveGoal) -> bool:
        """Whether a goal was chosen anew: not the active one, as the map shows it now."""
        return self.active_goal is None or self.active_goal.since_s != goal.since_s

    def spent_before_s(self, goal: Goal) -> float:
        """Seconds that count as spent on a goal that is taken up: what was, and a part of the
        base time for each return; 0 for a new one."""
        spent = (each.spent_s for each in self.left if each.is_about(goal))
        return next((s + RETURN_PART * GOAL_BASE_S for s in spent), 0.0)

    def leave(self, chosen: Goal, now_s: float) -> None:
        """Keep what was spent on the active goal if ``chosen`` replaces it.

        Two goals may take turns for ever: one that is seen only from some places is preferred there
        and gone elsewhere.
        """
        before = self.active_goal
        if before is None or successor([chosen], before.goal) is not None:
            return
        others = tuple(each for each in self.left if not each.is_about(before.goal))
        spent = LeftGoal(before.goal, now_s - before.since_s)
        self.left = (*others, spent)[-MAX_LEFT:]


def _without(
    candidates: tuple[ObjectCandidate, ...], rejected: ObjectCandidate
) -> tuple[ObjectCandidate, ...]:
    return tuple(c for c in candidates if c.cells.isdisjoint(rejected.cells))


def exhausted_viewpoints(candidate: ObjectCandidate) -> list[Xy]:
    """Places, in metres, from which more views of a candidate show nothing new."""
    if candidate.supported:
        return []
    return [tally.xy for tally in candidate.near_views if tally.frames >= VIEWS_PER_VIEWPOINT]


@dataclass(frozen=True, slots=True)
class DeadEnd:
    """A place, metres, with its surroundings when it was given up: occupancy uint8, row by row.

    What was in the way may have been a person, a chair or a closed door. Unknown floor that becomes
    known is no such change: then the border lies elsewhere and is another goal. returns: how often
    it was offered again before; open: whether it is offered now.
    """

    xy: Xy
    occupancy: bytes
    returns: int = 0
    open: bool = False

    def is_near(self, xy: Xy) -> bool:
        """Whether another place is within ``DEAD_END_AROUND_M``."""
        away_m = float(np.hypot(self.xy[0] - xy[0], self.xy[1] - xy[1]))
        return away_m <= DEAD_END_AROUND_M


def updated_dead_ends(
    dead_ends: tuple[DeadEnd, ...], given_up_xy: tuple[Xy, ...], map_view: MapView
) -> tuple[DeadEnd, ...]:
    """The dead ends of these places: a new one with its surroundings as they are, a known one
    open if they have changed. Open ones are kept, for the number of their returns."""
    known = {dead_end.xy: dead_end for dead_end in dead_ends}
    kept = [dead_end for dead_end in dead_ends if dead_end.open and dead_end.xy not in given_up_xy]
    for xy in dict.fromkeys(given_up_xy):
        before = known.get(xy)
        if before is None or before.open:
            near = [d.returns + 1 for d in dead_ends if d.open and d.is_near(xy)]
            kept.append(DeadEnd(xy, surroundings(map_view, xy).tobytes(), max(near, default=0)))
        elif before.returns < DEAD_END_RETURNS and _changed(before, map_view):
            kept.append(replace(before, open=True))
        else:
            kept.append(before)
    return tuple(kept)


def surroundings(map_view: MapView, xy: Xy) -> U8:
    """Occupancy (n, n) uint8 of the square around a place; unknown outside of the view."""
    reach = int(DEAD_END_AROUND_M / map_view.grid.cell_size_m)
    patch = np.full((2 * reach + 1, 2 * reach + 1), Occupancy.UNKNOWN, np.uint8)
    first = map_view.grid.cells(np.asarray(xy)) - reach
    lower = np.clip(first, 0, map_view.grid.shape)
    upper = np.clip(first + len(patch), 0, map_view.grid.shape)
    (x0, y0), (x1, y1) = lower, upper
    a, b = lower - first
    patch[a : a + x1 - x0, b : b + y1 - y0] = map_view.occupancy[x0:x1, y0:y1]
    return patch


def _changed(dead_end: DeadEnd, map_view: MapView) -> bool:
    now = surroundings(map_view, dead_end.xy)
    then = np.frombuffer(dead_end.occupancy, np.uint8).reshape(now.shape)
    both_known = (now != Occupancy.UNKNOWN) & (then != Occupancy.UNKNOWN)
    area_m2 = float((both_known & (now != then)).sum()) * map_view.cell_area_m2
    return area_m2 >= DEAD_END_CHANGED_M2


@dataclass(frozen=True, slots=True)
class Displacement:
    """Of a robot that was moved: why it stands, in words, until which second of active time, and
    whether its pose does not tell of it."""

    why: str
    until_s: float
    unnoticed: bool


@dataclass(slots=True)
class PlannerState:
    """State of the planner during one search; memory: of the present object.

    visited_frontiers: what looks at frontiers showed nothing of, kept for the whole search,
    because what could not be seen for one object cannot for the next, unless nothing else is left
    for it; unreached_frontiers: those of them that were given up on the way. crosses_gaps: paths
    may cross narrow gaps of unknown floor, because nothing else was left. trail: where the robot
    has been, metres. found_objects: of this search and those before on the same map; synonyms: of
    all these names. map_id and known_m2: of the map at the last step, the latter its known area.
    active_time_s: seconds with fresh inputs; last_step_s: time of the last step; stale_since_s:
    since when the inputs are stale, None while they are fresh; both of the planner's monotonic
    clock. crept_s: active time for which it has crept without a break. dead_ends: the places given
    up with what was around them. appeared: what has just appeared on the map. cost_to_go: of the
    last step, for one on the same map from the same place. displacement: while the robot stands
    because it was moved. refused: the last goal at which the robot's own navigation failed.
    """

    search: Search
    memory: TargetMemory = field(default_factory=TargetMemory)
    visited_frontiers: tuple[Xy, ...] = ()
    unreached_frontiers: tuple[Xy, ...] = ()
    crosses_gaps: bool = False
    trail: tuple[Xy, ...] = ()
    progress: ProgressMonitor | None = None
    pose: Pose2d | None = None
    found_objects: tuple[FoundObject, ...] = ()
    synonyms: Synonyms = NO_SYNONYMS
    map_id: str = ""
    known_m2: float = 0.0
    active_time_s: float = 0.0
    last_step_s: float | None = None
    crept_s: float = 0.0
    stale_since_s: float | None = None
    dead_ends: tuple[DeadEnd, ...] = ()
    appeared: Appeared = NOTHING
    cost_to_go: CostToGo | None = None
    displacement: Displacement | None = None
    refused: Pose2d | None = None

    def copy(self) -> PlannerState:
        """A state that changes apart from this one."""
        return replace(self, memory=self.memory.copy())

    @property
    def obstacles_xy(self) -> F64:
        """Virtual obstacles (B, 2), metres."""
        return self.progress.obstacles_xy if self.progress else np.zeros((0, 2))

    def move_to(self, pose: Pose2d) -> None:
        """The robot is here: its trail grows."""
        self.pose = pose
        self.trail = extended(self.trail, pose.xy, step_m=TRAIL_STEP_M, max_points=TRAIL_LENGTH)

    def forget_map(self) -> None:
        """The map was begun again: forget what came from it."""
        self.memory = TargetMemory()
        self.visited_frontiers = self.unreached_frontiers = ()
        self.crosses_gaps = False
        self.found_objects = ()
        self.dead_ends = ()

    def find(self, candidate: ObjectCandidate) -> None:
        """Remember a candidate just confirmed as the present object."""
        found = FoundObject(self.search.target, candidate.cells)
        self.found_objects = (*self.found_objects, found)[-MAX_FOUND_OBJECTS:]

    def landmarks(self, context: PlanningContext) -> Landmarks:
        """By what places are described now: the robot, what was found, and the anchors seen."""
        pose, size_m = context.pose, context.map_view.grid.cell_size_m
        things = [
            (name, anchor.xyz[:2])
            for name, seen in self.memory.anchors.items()
            for anchor in seen
            if anchor.sightings >= MIN_SIGHTINGS
        ]
        for found in self.found_objects:
            x, y = (np.mean(sorted(found.cells), axis=0) + 0.5) * size_m
            things.append((found.name, (float(x), float(y))))
        return Landmarks(pose.xy, pose.yaw_rad, tuple(things))

    def give_more_time(self, more_s: float) -> None:
        """Add to the time of the active goal, if there is one."""
        goal = self.memory.active_goal
        if goal is not None:
            self.memory.active_goal = replace(goal, since_s=goal.since_s + more_s)

    def give_up(self, goal: Goal, *, reached: bool = True) -> None:
        """Do not take this goal, active or not, again; no goal is active.

        reached: whether the robot was there, or gave it up on its way.
        """
        self.memory.active_goal = None
        if goal.kind is not GoalKind.FRONTIER:
            self.memory.given_up = (*self.memory.given_up, goal)
            return
        self.visited_frontiers = (*self.visited_frontiers, goal.look_xy)
        if not reached:
            self.unreached_frontiers = (*self.unreached_frontiers, goal.look_xy)

    def give_up_finished(self) -> None:
        """Give up the active goal if it was viewed for ``LINGER_S`` or its time is over."""
        active, now_s = self.memory.active_goal, self.active_time_s
        if active is None:
            return
        visited = active.arrived_s is not None and now_s - active.arrived_s >= LINGER_S
        if visited or now_s - active.since_s > active.budget_s:
            self.give_up(active.goal, reached=visited)

    def is_given_up(self, goal: Goal) -> bool:
        """Whether enough goals of its kind were given up near it.

        One visit decides about a frontier; an object may be visible from another viewpoint.
        """
        if goal.kind is GoalKind.FRONTIER:
            return any(goal.looks_at(xy, GIVEN_UP_RADIUS_M) for xy in self.visited_frontiers)
        tries = [
            gone
            for gone in self.memory.given_up
            if gone.kind is goal.kind and goal.looks_at(gone.look_xy, GIVEN_UP_RADIUS_M)
        ]
        return len(tries) >= MAX_LOOKS

    def new_goal(self, goal: Goal) -> ActiveGoal:
        """A goal that is taken up now; one that the robot comes back to gets what is left."""
        budget_s = GOAL_BASE_S + GOAL_S_PER_M * goal.utility.travel_m
        since_s = self.active_time_s - self.memory.spent_before_s(goal)
        return ActiveGoal(goal, since_s, budget_s, goal.look_xy)

    def reopen_changed(self, map_view: MapView) -> None:
        """Offer goals again that were given up, and around which obstacles came or went since."""
        given_up = self.memory.given_up
        given_up_xy = (*self.visited_frontiers, *(goal.look_xy for goal in given_up))
        if not given_up_xy:
            return
        self.dead_ends = updated_dead_ends(self.dead_ends, given_up_xy, map_view)
        again = {dead_end.xy for dead_end in self.dead_ends if dead_end.open}
        if again.isdisjoint(given_up_xy):
            return
        self.memory.given_up = tuple(goal for goal in given_up if goal.look_xy not in again)
        self.visited_frontiers = tuple(xy for xy in self.visited_frontiers if xy not in again)

    def reconsider(self, *, frontiers: bool, doubtful: tuple[ObjectCandidate, ...] = ()) -> None:
        """Consider rejected candidates once more, because no goal is left.

        doubtful: those that the map does not support and that are worth a look from another side;
        what was seen of them counts on. All others are forgotten until they are detected again.
        Frontiers that were given up on the way are offered again. frontiers: also those that stayed
        after their visit, since one of them may be the way to a part of the flat that noise cut
        off.
        """
        unreached = self.unreached_frontiers
        visited = tuple(xy for xy in self.visited_frontiers if xy not in unreached)
        self.memory = TargetMemory(
            reconsidered=True,
            disputed=doubtful,
            undecided=self.memory.undecided,
            aside=self.memory.aside,
            others=self.memory.others,
            anchors=self.memory.anchors,
        )
        self.visited_frontiers = () if frontiers else visited
        self.unreached_frontiers = ()
