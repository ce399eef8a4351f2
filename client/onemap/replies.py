"""What the gateway replies, as frozen dataclasses.

Each has ``document``, the JSON object as it came, with members that this version does not know.
Members that an older gateway leaves out are empty. Places are metres in the frame of the map: x
forward from where the robot started, y to its left.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime, timezone
from typing import Any

from onemap.choices import Choice
from onemap.endings import FindEvidence, SearchCoverage

Document = Mapping[str, Any]
FINAL_STATES = ("found", "not_found", "failed", "cancelled", "arrived", "interrupted")


@dataclass(frozen=True, slots=True)
class ObjectOutcome:
    """How the search for one object, or the drive to the place, ended.

    name: of the object, empty for a place; outcome: one of ``FINAL_STATES``; position_m: x, y, z
    of the object, None if it was not found; end_xy_m: where the robot stood then, None if that
    was not known; reason_code: why it failed, empty unless it did; coverage: what was looked at, if
    it was not found; evidence: frame, box and cells, if it was.
    """

    name: str
    outcome: str
    reason: str
    position_m: tuple[float, ...] | None
    score: float
    duration_s: float
    path_length_m: float
    end_xy_m: tuple[float, ...] | None
    reason_code: str
    coverage: SearchCoverage | None
    evidence: FindEvidence | None
    document: Document = field(repr=False, compare=False)

    @property
    def found(self) -> bool:
        """Whether the object was found."""
        return self.outcome == "found"

    @classmethod
    def of(cls, document: Document) -> ObjectOutcome:
        """The outcome that ``document`` describes."""
        position_m, end_xy_m = document.get("position_m"), document.get("end_xy_m")
        return cls(
            name=str(document["name"]),
            outcome=str(document["outcome"]),
            reason=str(document.get("reason", "")),
            position_m=_floats(position_m) if position_m else None,
            score=float(document.get("score", 0.0)),
            duration_s=float(document.get("duration_s", 0.0)),
            path_length_m=float(document.get("path_length_m", 0.0)),
            end_xy_m=_floats(end_xy_m) if end_xy_m else None,
            reason_code=str(document.get("reason_code") or ""),
            coverage=SearchCoverage.of(c) if (c := document.get("coverage")) else None,
            evidence=FindEvidence.of(e) if (e := document.get("evidence")) else None,
            document=document,
        )


@dataclass(frozen=True, slots=True)
class SearchSnapshot:
    """A search at one moment.

    state: exploring, approaching, confirming, or one of ``FINAL_STATES``; target: the object now
    sought; reason: in a sentence, what goes on or why it ended; results: of the objects that are
    done; updated_ns: nanoseconds since 1970; kind: find, go_to or look_at; place_m: x, y of the
    place to go to or to look at, None for objects; choice: where the robot drives now and why, None
    while it has no goal; reason_code: why it failed, empty unless it did.
    """

    id: str
    state: str
    objects: tuple[str, ...]
    target: str
    reason: str
    results: tuple[ObjectOutcome, ...]
    elapsed_s: float
    path_length_m: float
    updated_ns: int
    kind: str
    place_m: tuple[float, float] | None
    choice: Choice | None
    reason_code: str
    document: Document = field(repr=False, compare=False)

    @property
    def active(self) -> bool:
        """Whether the search still runs."""
        return self.state not in FINAL_STATES

    @property
    def all_found(self) -> bool:
        """Whether every object of the search was found; False for a place."""
        found = sum(result.found for result in self.results)
        return bool(self.objects) and found == len(self.objects)

    @property
    def subject(self) -> str:
        """What it is about now: the object sought, the place, or the search."""
        if self.place_m is not None:
            return f"({self.place_m[0]:g}, {self.place_m[1]:g})"
        return self.target or "search"

    @property
    def arrived(self) -> bool:
        """Whether the robot has reached the place, or looks at it; False for objects."""
        return self.state == "arrived"

    @classmethod
    def of(cls, document: Document) -> SearchSnapshot:
        """The snapshot that ``document`` describes."""
        return cls(
            id=str(document["id"]),
            state=str(document["state"]),
            objects=tuple(document["objects"]),
            target=str(document.get("target", "")),
            reason=str(document.get("reason", "")),
            results=tuple(map(ObjectOutcome.of, document["results"])),
            elapsed_s=float(document.get("elapsed_s", 0.0)),
            path_length_m=float(document.get("path_length_m", 0.0)),
            updated_ns=int(document.get("updated_ns", 0)),
            kind=str(document.get("kind", "find")),
            place_m=_point(place_m) if (place_m := document.get("place_m")) else None,
            choice=Choice.of(choice) if (choice := document.get("choice")) else None,
            reason_code=str(document.get("reason_code") or ""),
            document=document,
        )


@dataclass(frozen=True, slots=True)
class MapContent:
    """What the map holds after it was saved, loaded or cleared.

    path: where the file lies on the mapper's machine; empty if there is none.
    """

    path: str
    cells_observed: int
    frames_fused: int
    file_bytes: int
    document: Document = field(repr=False, compare=False)

    @classmethod
    def of(cls, document: Document) -> MapContent:
        """The content that ``document`` describes."""
        return cls(
            path=str(document["path"]),
            cells_observed=int(document["cells_observed"]),
            frames_fused=int(document["frames_fused"]),
            file_bytes=int(document["file_bytes"]),
            document=document,
        )


@dataclass(frozen=True, slots=True)
class StoredMap:
    """A map file in the mapper's map folder.

    saved_ns: nanoseconds since 1970; problem: why the file cannot be loaded, empty if it can.
    """

    name: str
    file_bytes: int
    saved_ns: int
    encoder_id: str
    cells_observed: int
    problem: str
    document: Document = field(repr=False, compare=False)

    @property
    def saved_at(self) -> datetime:
        """When it was saved, in UTC."""
        return datetime.fromtimestamp(self.saved_ns / 1e9, tz=timezone.utc)

    @classmethod
    def of(cls, document: Document) -> StoredMap:
        """The file that ``document`` describes."""
        return cls(
            name=str(document["name"]),
            file_bytes=int(document["file_bytes"]),
            saved_ns=int(document["saved_ns"]),
            encoder_id=str(document["encoder_id"]),
            cells_observed=int(document["cells_observed"]),
            problem=str(document["problem"]),
            document=document,
        )


@dataclass(frozen=True, slots=True)
class MapStatistics:
    """The map in numbers.

    age_s: of the newest frame in the map, None if it is empty; bounds_m: x_min, y_min, x_max,
    y_max; rate_hz: updates per second.
    """

    revision: int
    age_s: float | None
    bounds_m: tuple[float, float, float, float]
    observed_m2: float
    free_m2: float
    occupied_m2: float
    rate_hz: float
    document: Document = field(repr=False, compare=False)

    @classmethod
    def of(cls, document: Document) -> MapStatistics:
        """The numbers that ``document`` holds."""
        return cls(
            revision=int(document["revision"]),
            age_s=_number(document["age_s"]),
            bounds_m=_box(document["bounds_m"]),
            observed_m2=float(document["observed_m2"]),
            free_m2=float(document["free_m2"]),
            occupied_m2=float(document["occupied_m2"]),
            rate_hz=float(document["rate_hz"]),
            document=document,
        )


@dataclass(frozen=True, slots=True)
class ServiceHealth:
    """One service, or the robot: ``condition`` is ok, degraded or down; ``problem`` says why."""

    name: str
    condition: str
    problem: str
    document: Document = field(repr=False, compare=False)

    @classmethod
    def of(cls, document: Document) -> ServiceHealth:
        """The health that ``document`` describes."""
        return cls(
            name=str(document["name"]),
            condition=str(document["condition"]),
            problem=str(document["problem"]),
            document=document,
        )


@dataclass(frozen=True, slots=True)
class StreamHealth:
    """One stream of messages; ``age_s``: since the last message, None if there was none."""

    name: str
    age_s: float | None
    rate_hz: float
    document: Document = field(repr=False, compare=False)

    @classmethod
    def of(cls, document: Document) -> StreamHealth:
        """The health that ``document`` describes."""
        return cls(
            name=str(document["name"]),
            age_s=_number(document["age_s"]),
            rate_hz=float(document["rate_hz"]),
            document=document,
        )


@dataclass(frozen=True, slots=True)
class SystemStatus:
    """What runs: ``ready`` if a search could start now, otherwise ``problem`` says why not."""

    ready: bool
    problem: str
    services: tuple[ServiceHealth, ...]
    streams: tuple[StreamHealth, ...]
    document: Document = field(repr=False, compare=False)

    @classmethod
    def of(cls, document: Document) -> SystemStatus:
        """The status that ``document`` describes."""
        return cls(
            ready=bool(document.get("ready", False)),
            problem=str(document.get("problem", "")),
            services=tuple(map(ServiceHealth.of, document.get("services", ()))),
            streams=tuple(map(StreamHealth.of, document.get("streams", ()))),
            document=document,
        )


def _number(value: Any) -> float | None:
    return None if value is None else float(value)


def _floats(values: Iterable[Any]) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def _point(values: Iterable[Any]) -> tuple[float, float]:
    x, y = _floats(values)
    return x, y


def _box(values: Iterable[Any]) -> tuple[float, float, float, float]:
    x_min, y_min, x_max, y_max = _floats(values)
    return x_min, y_min, x_max, y_max
