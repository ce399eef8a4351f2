"""Events of a search: what the policy has noticed, with when and where."""

from __future__ import annotations

from dataclasses import dataclass

from onemap_planner.world.candidates import ObjectCandidate
from onemap_shared.messages import NO_COVERAGE, Coverage, FailureCode


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
