"""What a search can be doing, what can happen to it, and what is known of it: plain values."""

from __future__ import annotations

from dataclasses import dataclass

from onemap_planner.world.candidates import ObjectCandidate
from onemap_shared.messages import ObjectResult, SearchState

# ---- phases: what the search for the present object is doing


@dataclass(frozen=True, slots=True)
class Starting:
    """Waiting for the map's answer about this object."""


@dataclass(frozen=True, slots=True)
class LookingAround:
    """Turning in place; the camera sees a part of the circle only."""

    turned_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Exploring:
    """Walking to frontiers and regions."""


@dataclass(frozen=True, slots=True)
class Approaching:
    """Walking up to what may be the object."""

    candidate: ObjectCandidate


@dataclass(frozen=True, slots=True)
class Confirming:
    """Standing before it, waiting for detections that agree.

    candidate: as it was known on arrival; since_s: attentive seconds at arrival.
    """

    candidate: ObjectCandidate
    since_s: float


@dataclass(frozen=True, slots=True)
class Finished:
    """The search has ended as ``state``."""

    state: SearchState


Phase = Starting | LookingAround | Exploring | Approaching | Confirming | Finished

# ---- events: what has been noticed


@dataclass(frozen=True, slots=True)
class MapReady:
    """The map has answered; ``look_around``: the robot does not know its surroundings."""

    look_around: bool


@dataclass(frozen=True, slots=True)
class Rotated:
    """The robot has turned by this much."""

    by_rad: float


@dataclass(frozen=True, slots=True)
class MapRestarted:
    """The map has begun anew."""


@dataclass(frozen=True, slots=True)
class CandidateSelected:
    """Detector and map agree on a place that can be walked up to."""

    candidate: ObjectCandidate


@dataclass(frozen=True, slots=True)
class Arrived:
    """The robot stands before the candidate, as it is known now, and faces it."""

    candidate: ObjectCandidate


@dataclass(frozen=True, slots=True)
class Confirmed:
    """Enough detections agree."""

    candidate: ObjectCandidate


@dataclass(frozen=True, slots=True)
class Rejected:
    """The candidate is not the object, or cannot be walked up to."""


@dataclass(frozen=True, slots=True)
class Exhausted:
    """Nothing reachable is left to look at."""

    reason: str


@dataclass(frozen=True, slots=True)
class TargetFailed:
    """This object cannot be searched for any longer; the next one may."""

    reason: str


@dataclass(frozen=True, slots=True)
class SearchFailed:
    """The robot cannot search at all."""

    reason: str


@dataclass(frozen=True, slots=True)
class Cancelled:
    """Somebody called it off."""


Event = (
    MapReady
    | Rotated
    | MapRestarted
    | CandidateSelected
    | Arrived
    | Confirmed
    | Rejected
    | Exhausted
    | TargetFailed
    | SearchFailed
    | Cancelled
)


@dataclass(frozen=True, slots=True)
class EventStamp:
    """When and where something happened.

    now_s: the planner's monotonic clock; active_time_s: the same less all the time in which
    the senses were too old to act on, so that no time limit runs while a service is away.
    """

    now_s: float
    active_time_s: float
    xy: tuple[float, float] | None
    odometer_m: float


@dataclass(frozen=True, slots=True)
class TargetStart:
    """Where and when the search for the present object began; ``xy`` None: not known yet."""

    since_s: float
    since_active_time_s: float
    xy: tuple[float, float] | None
    odometer_m: float


@dataclass(frozen=True, slots=True)
class Search:
    """One search: its objects, how far it is, and the results so far.

    started_ns and ended_ns: nanoseconds since 1970; ended_ns is None until it is over.
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

    @property
    def active(self) -> bool:
        """Whether the robot is still at it."""
        return not isinstance(self.phase, Finished)

    @property
    def target(self) -> str:
        """The object now sought, empty when the search is over."""
        return self.objects[self.index] if self.active else ""
