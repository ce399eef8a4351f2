"""A search: its phases, the events that move it from one to the next, and the transitions.

Plain values; time, position and odometer come in with the ``EventStamp``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from onemap_planner.sentences import (
    MAP_ANEW,
    MOVED,
    RETURNED,
    RETURNING,
    START_LOST,
    approaching,
    asking,
    confirmed,
    confirming,
    driving,
    looking_around,
    looking_for,
    not_returned,
)
from onemap_planner.world.candidates import MERGE_M, ObjectCandidate
from onemap_shared.messages import (
    MAX_PASSED,
    NO_CHOICE,
    NO_COVERAGE,
    NO_DETAIL,
    After,
    Coverage,
    Detail,
    FailureCode,
    GoalChoice,
    ObjectResult,
    PassedThing,
    SearchKind,
    SearchRequest,
    SearchState,
    SearchStatus,
    subject_of,
)


@dataclass(frozen=True, slots=True)
class Starting:
    """Waiting for the first view of the map for this object."""


@dataclass(frozen=True, slots=True)
class LookingAround:
    """Turning in place until the camera has seen the full circle, of which it shows a part."""

    turned_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Exploring:
    """Driving to frontiers, regions and uncertain detections."""


@dataclass(frozen=True, slots=True)
class Approaching:
    """Driving to a viewpoint of the candidate."""

    candidate: ObjectCandidate


@dataclass(frozen=True, slots=True)
class Confirming:
    """At the viewpoint, counting detections that agree.

    candidate: as it was known on arrival; since_s: active time at arrival, seconds.
    """

    candidate: ObjectCandidate
    since_s: float


@dataclass(frozen=True, slots=True)
class Destination:
    """A place, xy metres, to drive to or (kind ``LOOK_AT``) to look at."""

    kind: SearchKind
    xy: tuple[float, float]

    @classmethod
    def of(cls, request: SearchRequest) -> Destination | None:
        """The destination of a request; None if it is for objects."""
        if request.kind is SearchKind.FIND:
            return None
        x, y = request.place_m
        return cls(request.kind, (x, y))


@dataclass(frozen=True, slots=True)
class Driving:
    """Driving to the destination, exploring what is unknown on the way."""

    destination: Destination


@dataclass(frozen=True, slots=True)
class Finished:
    """The search has ended as ``state``."""

    state: SearchState


Phase = Starting | LookingAround | Exploring | Approaching | Confirming | Driving | Finished


@dataclass(frozen=True, slots=True)
class TargetStart:
    """Where and when the search for the present object began; xy None: no odometry yet."""

    since_s: float
    since_active_time_s: float
    xy: tuple[float, float] | None
    odometer_m: float


@dataclass(frozen=True, slots=True)
class Budget:
    """How far a search may drive and how long it may take, with all its objects; 0: no limit."""

    max_distance_m: float = 0.0
    max_time_s: float = 0.0

    @classmethod
    def of(cls, request: SearchRequest) -> Budget:
        """The budget of a request."""
        return cls(request.max_distance_m, request.max_time_s)


NO_BUDGET = Budget()


@dataclass(frozen=True, slots=True)
class WayBack:
    """The robot returns to where it set out; outcome and reason: of the objects, which are done."""

    destination: Destination
    outcome: SearchState
    reason: str


@dataclass(frozen=True, slots=True)
class Search:
    """One search: its objects, the index and phase of the present one, the results so far.

    destination: of a drive to a place, which has no objects; None for a search for objects.
    started_ns and ended_ns: nanoseconds since 1970; ended_ns is None until it is over. choice: the
    last decision where to drive, without options when it is over. slow: why the robot creeps, and
    what helps; empty if it does not. details: what is said of each object, or nothing of any;
    stay_out: names of places that the robot does not enter. driver: the life of the robot's driver
    that it was accepted for, as ``DriverLife`` counts them; map_count and jump_count: the same of
    the map and of jumps of the pose, as ``LatestInputs`` does. continues: id of the ended search
    whose rest it is, or empty. began_s: of the planner's monotonic clock; took_s: seconds until its
    end, None before. passed: things of the present object's name that are left aside. start_xy:
    where the robot stood when it was accepted, None without odometry; start_lost: its pose jumped
    since, or the map was replaced, so that this may be another place; way_back: once it returns
    there, by ``after``; returned_m: metres driven for that.
    """

    search_id: str
    objects: tuple[str, ...]
    index: int
    phase: Phase
    target_start: TargetStart
    results: tuple[ObjectResult, ...]
    reason: str
    started_ns: int
    ended_ns: int | None = None
    destination: Destination | None = None
    choice: GoalChoice = NO_CHOICE
    slow: str = ""
    budget: Budget = NO_BUDGET
    details: tuple[Detail, ...] = ()
    stay_out: tuple[str, ...] = ()
    driver: int = 1
    map_count: int = 1
    jump_count: int = 0
    continues: str = ""
    began_s: float = 0.0
    took_s: float | None = None
    passed: tuple[PassedThing, ...] = ()
    after: After = After.STAY
    start_lost: bool = False
    start_xy: tuple[float, float] | None = None
    way_back: WayBack | None = None
    returned_m: float = 0.0

    @property
    def active(self) -> bool:
        """Whether the search has not ended."""
        return not isinstance(self.phase, Finished)

    @property
    def target(self) -> str:
        """The object now searched for, empty when the search is over or for a place."""
        return self.objects[self.index] if self._seeks else ""

    @property
    def detail(self) -> Detail:
        """What is said of the object now searched for besides its name."""
        return self.details[self.index] if self._seeks and self.details else NO_DETAIL

    @property
    def _seeks(self) -> bool:
        return self.active and self.index < len(self.objects)

    @property
    def kind(self) -> SearchKind:
        """What the search is for."""
        return SearchKind.FIND if self.destination is None else self.destination.kind

    @property
    def subject(self) -> str:
        """What the search is for, in words: the present object as described, or the place."""
        place = self.destination.xy if self.destination else ()
        return subject_of(self.described or ", ".join(self.objects), place)

    @property
    def described(self) -> str:
        """The object now searched for with what is said of it, in words; empty as ``target``."""
        return self.detail.of(self.target)


@dataclass(frozen=True, slots=True)
class EventStamp:
    """When and where an event happened.

    now_s: the planner's monotonic clock; active_time_s: seconds with fresh inputs, so that no
    time limit runs while a service is away; xy metres, None without odometry.
    """

    now_s: float
    active_time_s: float
    xy: tuple[float, float] | None
    odometer_m: float


@dataclass(frozen=True, slots=True)
class MapReady:
    """The map has answered; look_around: too little of the surroundings is known.

    seen_rad: what the camera shows of the circle before the robot turns.
    """

    look_around: bool
    seen_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Rotated:
    """The robot has turned left by this angle."""

    by_rad: float


@dataclass(frozen=True, slots=True)
class MapRestarted:
    """The map was cleared or its mapper restarted."""


@dataclass(frozen=True, slots=True)
class Displaced:
    """The robot was moved, or its pose was wrong, and the pose did not tell of it."""


@dataclass(frozen=True, slots=True)
class CandidateSelected:
    """A candidate was detected often enough and has a reachable viewpoint."""

    candidate: ObjectCandidate


@dataclass(frozen=True, slots=True)
class Arrived:
    """The robot has reached the viewpoint of the candidate, as it is known now."""

    candidate: ObjectCandidate


@dataclass(frozen=True, slots=True)
class Confirmed:
    """Enough new detections agree with the candidate; checks: what of its description holds."""

    candidate: ObjectCandidate
    checks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Rejected:
    """The candidate is not the object, or cannot be reached."""


@dataclass(frozen=True, slots=True)
class Ending:
    """The search for the present object, or the drive, ends.

    coverage: what was looked at; candidate: what was found; whole: no other object is searched for;
    checks: which parts of its description hold; excluded: it is one of the names that are excluded.
    """

    outcome: SearchState
    reason: str
    code: FailureCode = FailureCode.NONE
    coverage: Coverage = NO_COVERAGE
    candidate: ObjectCandidate | None = None
    whole: bool = False
    checks: tuple[str, ...] = ()
    excluded: bool = False


CANCELLED = Ending(SearchState.CANCELLED, "cancelled", whole=True)

Event = (
    MapReady
    | Rotated
    | MapRestarted
    | Displaced
    | CandidateSelected
    | Arrived
    | Confirmed
    | Rejected
    | Ending
)


def found_by(event: Event) -> ObjectCandidate | None:
    """What an event shows to be kept under the name of the present object; None if nothing."""
    if isinstance(event, Ending):
        return None if event.excluded else event.candidate
    return event.candidate if isinstance(event, Confirmed) else None


def new_search(
    search_id: str,
    objects: tuple[str, ...],
    stamp: EventStamp,
    started_ns: int,
    destination: Destination | None = None,
) -> Search:
    """A new search at its first object, or without objects a drive to the destination."""
    start = _start(stamp)
    search = Search(
        search_id, objects, 0, Starting(), start, (), "", started_ns, destination=destination
    )
    search = replace(search, start_xy=stamp.xy)
    return replace(search, reason=_starting(search), began_s=stamp.now_s)


def transition(search: Search, event: Event, stamp: EventStamp) -> Search:  # noqa: PLR0911
    """The search after the event; an event without a row for its phase changes nothing."""
    match search.phase, event:
        case (Finished(), _):
            return search
        case (_, Ending()) if search.way_back is not None:
            return _returned(search, search.way_back, event, stamp)
        case (_, Ending()):
            return _ended(search, event, stamp)
        case (Starting(), MapReady(look_around, seen_rad)):
            start = search.target_start
            if start.xy is None:
                search = replace(search, target_start=replace(start, xy=stamp.xy))
            search = replace(search, start_xy=search.start_xy or stamp.xy)
            looks = _look_around(search, seen_rad=seen_rad)
            return looks if look_around else _set_out(search)
        case (LookingAround(turned_rad), Rotated(by_rad)):
            total = turned_rad + by_rad
            full = total >= 2 * math.pi
            return _set_out(search) if full else replace(search, phase=LookingAround(total))
        case (Exploring() | Approaching() | Confirming() | Driving(), MapRestarted() | Displaced()):
            return _look_around(search, MOVED if isinstance(event, Displaced) else MAP_ANEW)
        case (LookingAround() | Exploring() | Confirming(), CandidateSelected(candidate)):
            search = without_choice(search)
            return replace(
                search, phase=Approaching(candidate), reason=_approaching(search, candidate)
            )
        case (Approaching(), Arrived(candidate)):
            standing = Confirming(candidate, stamp.active_time_s)
            choice = replace(search.choice, sentence="")  # it is there: the reason tells more
            reason = confirming(search.target)
            return replace(search, phase=standing, choice=choice, reason=reason)
        case (Confirming(), Confirmed(candidate, checks)):
            reason = confirmed(candidate.sightings, candidate.agreement, search.target, checks)
            ending = Ending(SearchState.FOUND, reason, candidate=candidate, checks=checks)
            return _ended(search, ending, stamp)
        case (Approaching() | Confirming(), Rejected()):
            return _set_out(search)
        case _:
            return search


def status(
    search: Search,
    stamp: EventStamp,
    *,
    now_ns: int,
    waiting: str = "",
    hold: str = "",
) -> SearchStatus:
    """The message about the search; waiting: why the robot stands still, or empty.

    hold: why the robot may not obey, which counts after the end too; or empty. ``updated_ns`` of a
    search that is over is when it ended.
    """
    also = hold or (search.slow if search.active else "")
    reason = f"{reason_of(search)}; {also}" if also else reason_of(search)
    return SearchStatus(
        search_id=search.search_id,
        state=_wire_state(search),
        objects=search.objects,
        index=min(search.index, max(len(search.objects) - 1, 0)),
        reason=waiting if waiting and search.active else reason,
        results=search.results,
        started_ns=search.started_ns,
        updated_ns=now_ns if search.ended_ns is None else search.ended_ns,
        path_length_m=driven_m(search, stamp.odometer_m),
        kind=search.kind,
        place_m=search.destination.xy if search.destination else (),
        choice=search.choice,
        details=search.details,
        stay_out=search.stay_out,
        max_distance_m=search.budget.max_distance_m,
        max_time_s=search.budget.max_time_s,
        elapsed_s=elapsed_s(search, stamp.now_s),
        continues=search.continues,
        passed=search.passed,
        after=search.after,
        start_m=() if search.start_lost else search.start_xy or (),
    )


def reason_of(search: Search) -> str:
    """What happens now and why, or why the search ended, in one sentence."""
    return search.choice.sentence or search.reason


def driven_m(search: Search, odometer_m: float) -> float:
    """Metres driven in a search."""
    done = sum(result.path_length_m for result in search.results)
    done += search.returned_m
    return done + (odometer_m - search.target_start.odometer_m if search.active else 0.0)


def elapsed_s(search: Search, now_s: float) -> float:
    """Seconds that a search has taken, for all its objects."""
    return max(now_s - search.began_s, 0.0) if search.took_s is None else search.took_s


def without_choice(search: Search) -> Search:
    """The search without a goal."""
    return replace(search, choice=GoalChoice(search.choice.number))


def passed_by(search: Search, xy: tuple[float, float], reason: str = "") -> Search:
    """The search that leaves a thing at a place (metres) aside; without a reason, no longer.

    What is said first of a thing stays: distances change with every view of it.
    """
    near = [each for each in search.passed if math.dist(each.position_m, xy) <= MERGE_M]
    kinds = [each.reason.partition(":")[0] for each in near]
    if kinds == ([reason.partition(":")[0]] if reason else []):
        return search
    others = tuple(each for each in search.passed if each not in near)
    now = (PassedThing(xy, reason),) if reason else ()
    return replace(search, passed=(*others, *now)[-MAX_PASSED:])


def _start(stamp: EventStamp) -> TargetStart:
    return TargetStart(stamp.now_s, stamp.active_time_s, stamp.xy, stamp.odometer_m)


def _starting(search: Search) -> str:
    return asking(search.described or search.subject)


def _wire_state(search: Search) -> SearchState:
    match search.phase:
        case Finished(state):
            return state
        case _ if search.way_back is not None:
            return SearchState.RETURNING
        case Approaching() | Driving():
            return SearchState.APPROACHING
        case Confirming():
            return SearchState.CONFIRMING
        case _:
            return SearchState.EXPLORING


def _result(search: Search, ending: Ending, stamp: EventStamp) -> ObjectResult:
    candidate = ending.candidate
    view = candidate.best_view if candidate else None
    return ObjectResult(
        name=search.target,
        outcome=ending.outcome,
        reason=ending.reason,
        position_m=candidate.xyz if candidate else (),
        score=candidate.similarity if candidate else 0.0,
        duration_s=stamp.now_s - search.target_start.since_s,
        path_length_m=stamp.odometer_m - search.target_start.odometer_m,
        start_xy_m=search.target_start.xy or (),
        end_xy_m=stamp.xy or (),
        reason_code=ending.code,
        coverage=ending.coverage,
        frame_ns=view.stamp_ns if view else 0,
        box_px=view.box_px if view else (),
        cells=len(candidate.cells) if candidate else 0,
        checks=ending.checks,
        index=search.index,
    )


# What a search for several objects ends as: the first of these that one of them ended as.
WORST_FIRST = (
    SearchState.FAILED,
    SearchState.NOT_FOUND,
    SearchState.FOUND_OTHER,
    SearchState.FOUND,
)


def _ended(search: Search, ending: Ending, stamp: EventStamp) -> Search:
    """The present object is done; the next begins, or the search ends."""
    results = (*search.results, _result(search, ending, stamp))
    search = without_choice(search)
    if not ending.whole and len(results) < len(search.objects):
        search = replace(search, results=results, index=search.index + 1)
        search = replace(search, phase=Starting(), target_start=_start(stamp), passed=())
        return replace(search, reason=_starting(search))
    outcome, reason = ending.outcome, ending.reason
    if not ending.whole and search.destination is None:
        outcomes = {result.outcome for result in results}
        outcome, reason = next(s for s in WORST_FIRST if s in outcomes), _summary(results)
    search = replace(search, results=results)
    if search.after is After.RETURN and not ending.whole and search.start_xy is not None:
        if search.start_lost:
            return _finished(search, outcome, f"{reason}; {not_returned(START_LOST)}", stamp)
        back = WayBack(Destination(SearchKind.GO_TO, search.start_xy), outcome, reason)
        begun = replace(search, way_back=back, index=len(search.objects))
        return _set_out(replace(begun, target_start=_start(stamp)))
    return _finished(search, outcome, reason, stamp)


def _returned(search: Search, back: WayBack, ending: Ending, stamp: EventStamp) -> Search:
    """The robot is back, or comes no further: what the search found stays its outcome."""
    search = replace(
        without_choice(search), returned_m=stamp.odometer_m - search.target_start.odometer_m
    )
    if ending.outcome in (SearchState.CANCELLED, SearchState.INTERRUPTED):
        return _finished(search, ending.outcome, ending.reason, stamp)
    arrived = ending.outcome is SearchState.ARRIVED
    reason = f"{back.reason}; {RETURNED if arrived else not_returned(ending.reason)}"
    return _finished(search, back.outcome, reason, stamp)


def _finished(search: Search, outcome: SearchState, reason: str, stamp: EventStamp) -> Search:
    took_s = elapsed_s(search, stamp.now_s)
    return replace(search, phase=Finished(outcome), reason=reason, took_s=took_s)


def _summary(results: tuple[ObjectResult, ...]) -> str:
    found = [result.name for result in results if result.outcome is SearchState.FOUND]
    missing = [
        f"{result.name}: {result.reason}"
        for result in results
        if result.outcome is not SearchState.FOUND
    ]
    text = f"found {len(found)} of {len(results)}"
    return text if not missing else f"{text}; {'; '.join(missing)}"


def _set_out(search: Search) -> Search:
    search, destination = without_choice(search), search.destination
    if search.way_back is not None:
        return replace(search, phase=Driving(search.way_back.destination), reason=RETURNING)
    if destination is None:
        return replace(search, phase=Exploring(), reason=looking_for(search.described))
    look = destination.kind is SearchKind.LOOK_AT
    reason = driving(search.subject, look=look)
    return replace(search, phase=Driving(destination), reason=reason)


def _look_around(search: Search, before: str = "", *, seen_rad: float = 0.0) -> Search:
    sought = "" if search.way_back is not None else search.described or search.subject
    reason = before + looking_around(sought)
    return replace(without_choice(search), phase=LookingAround(seen_rad), reason=reason)


def _approaching(search: Search, candidate: ObjectCandidate) -> str:
    return approaching(search.target, candidate.sightings)
