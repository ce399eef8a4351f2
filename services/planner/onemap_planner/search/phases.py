"""A search, its phases, and the events that move it from one to the next: plain values."""

from __future__ import annotations

from dataclasses import dataclass

from onemap_planner.world.candidates import ObjectCandidate
from onemap_shared.messages import (
    NO_CHOICE,
    NO_COVERAGE,
    Coverage,
    FailureCode,
    GoalChoice,
    ObjectResult,
    SearchKind,
    SearchOrder,
    SearchRequest,
    SearchState,
    subject_of,
)


@dataclass(frozen=True, slots=True)
class Starting:
    """Waiting for the first view of the map for this object."""


@dataclass(frozen=True, slots=True)
class LookingAround:
    """Turning in place by a full circle, because the camera sees only a part of it."""

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
class PausedTarget:
    """What was spent on an object that another one was preferred to.

    index: of the object; spent_s and spent_active_time_s: seconds; driven_m: metres; xy: where
    the search for it began, None if that is not known.
    """

    index: int
    spent_s: float
    spent_active_time_s: float
    driven_m: float
    xy: tuple[float, float] | None


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
class Search:
    """One search: its objects, the index and phase of the present one, the results so far.

    done: indices of the objects of the results; planned: indices of those still sought in the
    cheapest order known, empty until there is one; paused: those that were begun and put aside.
    destination: of a drive to a place, which has no objects; None for a search for objects.
    started_ns and ended_ns: nanoseconds since 1970; ended_ns is None until it is over. choice: the
    last decision where to drive, without options when it is over.
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
    order: SearchOrder = SearchOrder.GIVEN
    done: tuple[int, ...] = ()
    planned: tuple[int, ...] = ()
    paused: tuple[PausedTarget, ...] = ()
    choice: GoalChoice = NO_CHOICE
    budget: Budget = NO_BUDGET

    @property
    def active(self) -> bool:
        """Whether the search has not ended."""
        return not isinstance(self.phase, Finished)

    @property
    def target(self) -> str:
        """The object now searched for, empty when the search is over or for a place."""
        return self.objects[self.index] if self.active and self.objects else ""

    @property
    def kind(self) -> SearchKind:
        """What the search is for."""
        return SearchKind.FIND if self.destination is None else self.destination.kind

    @property
    def subject(self) -> str:
        """What the search is for, in words: the present object or the place."""
        return subject_of(self.target, self.destination.xy if self.destination else ())


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
    """The map has answered; look_around: too little of the surroundings is known."""

    look_around: bool


@dataclass(frozen=True, slots=True)
class Rotated:
    """The robot has turned left by this angle."""

    by_rad: float


@dataclass(frozen=True, slots=True)
class MapRestarted:
    """The map was cleared or its mapper restarted."""


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
    """Enough new detections agree with the candidate."""

    candidate: ObjectCandidate


@dataclass(frozen=True, slots=True)
class Rejected:
    """The candidate is not the object, or cannot be reached."""


@dataclass(frozen=True, slots=True)
class DestinationReached:
    """The robot stands at the destination, or where it sees it; reason: how far from it."""

    reason: str


@dataclass(frozen=True, slots=True)
class Exhausted:
    """No reachable goal is left; coverage: what a search for an object has looked at."""

    reason: str
    coverage: Coverage = NO_COVERAGE


@dataclass(frozen=True, slots=True)
class Reordered:
    """The cheapest order of the objects still sought, by their indices, has changed."""

    indices: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class TargetFailed:
    """The search for this object ends without a result; the next object may be searched."""

    reason: str
    code: FailureCode


@dataclass(frozen=True, slots=True)
class SearchFailed:
    """The whole search ends: the robot cannot go on."""

    reason: str
    code: FailureCode


@dataclass(frozen=True, slots=True)
class Cancelled:
    """The search was cancelled by request."""


@dataclass(frozen=True, slots=True)
class Interrupted:
    """The planner was stopped, or away while other things changed; reason: which."""

    reason: str


Event = (
    MapReady
    | Rotated
    | MapRestarted
    | CandidateSelected
    | Arrived
    | Confirmed
    | Rejected
    | DestinationReached
    | Exhausted
    | Reordered
    | TargetFailed
    | SearchFailed
    | Cancelled
    | Interrupted
)
