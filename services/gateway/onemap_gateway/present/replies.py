"""What clients get over HTTP, with examples for the documentation."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from onemap_gateway.present.choices import CHOICE_EXAMPLE, ChoiceReport
from onemap_gateway.present.endings import CoverageReport, EvidenceReport
from onemap_shared.messages import FailureCode, SearchKind, SearchOrder, SearchState

Time = Annotated[
    str,
    Field(
        description="RFC 3339, in UTC, cut to milliseconds.",
        json_schema_extra={"format": "date-time"},
    ),
]
Nanoseconds = Annotated[
    str,
    Field(
        description="Nanoseconds since 1970; a string, because JavaScript rounds such numbers.",
        json_schema_extra={"pattern": "^[0-9]+$"},
    ),
]


ReasonCode = Annotated[
    FailureCode | None,
    Field(
        description="Why it failed; null unless it did. "
        + " ".join(f"`{code}`: {code.sentence}" for code in FailureCode if code)
    ),
]


class ObjectReport(BaseModel):
    """How the search for one object, or the drive to the place, ended."""

    name: str = Field(description="Of the object; empty for a place.")
    outcome: SearchState
    reason: str
    position_m: tuple[float, float, float] | None = Field(description="x, y, z; null: not found.")
    score: float
    duration_s: float
    path_length_m: float
    start_xy_m: tuple[float, float] | None
    end_xy_m: tuple[float, float] | None
    reason_code: ReasonCode = None
    coverage: CoverageReport | None = Field(default=None, description="If it was not found.")
    evidence: EvidenceReport | None = Field(default=None, description="If it was found.")


class SearchReport(BaseModel):
    """Progress of a search; ``state`` is that of the object now sought, or the final one."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "id": "8f14e45f",
                    "kind": "find",
                    "place_m": None,
                    "state": "exploring",
                    "active": True,
                    "objects": ["sofa", "kettle"],
                    "order": "given",
                    "index": 0,
                    "target": "sofa",
                    "reason": "Walking to the frontier that looks most like a sofa.",
                    "reason_code": None,
                    "results": [],
                    "choice": CHOICE_EXAMPLE,
                    "elapsed_s": 12.4,
                    "path_length_m": 3.2,
                    "started_at": "2026-01-01T00:00:00.000Z",
                    "updated_at": "2026-01-01T00:00:12.400Z",
                    "started_ns": "1767225600000000000",
                    "updated_ns": "1767225612400000000",
                }
            ]
        }
    )

    id: str
    kind: SearchKind
    place_m: tuple[float, float] | None = Field(
        description="x, y of the place to drive to or to look at, metres; null for objects."
    )
    state: SearchState
    active: bool = Field(description="Whether the search still runs.")
    objects: tuple[str, ...] = Field(description="What is to be found; empty for a place.")
    order: SearchOrder = Field(description="Of the objects, as requested: given or any.")
    index: int = Field(description="Which of the objects is now sought, from 0.")
    target: str = Field(
        description="The object now sought; empty when the search is over or for a place."
    )
    reason: str = Field(description="In a sentence, what is going on or why it ended.")
    reason_code: ReasonCode = None
    results: list[ObjectReport] = Field(
        description="Of the objects that are done, in the order of the request."
    )
    choice: ChoiceReport | None = Field(
        default=None, description="Where the robot drives, and why; null while it has no goal."
    )
    elapsed_s: float
    path_length_m: float
    started_at: Time
    updated_at: Time
    started_ns: Nanoseconds
    updated_ns: Nanoseconds


class SearchListReply(BaseModel):
    """The searches that the planner remembers, newest first."""

    searches: list[SearchReport]
    left_out: int = Field(description="Older searches that one reply cannot hold; usually 0.")


class MapChange(BaseModel):
    """What the map holds after it was saved, loaded or cleared."""

    path: str = Field(description="Where the file lies on the mapper's machine; empty if none.")
    encoder_id: str
    text_space: str
    cell_size_m: float
    cells_observed: int
    frames_fused: int
    file_bytes: int


class SavedMapReport(BaseModel):
    """A map in the mapper's map folder; without content if its file cannot be read."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "name": "flat",
                    "file_bytes": 2514932,
                    "saved_at": "2026-01-01T00:00:12.400Z",
                    "saved_ns": "1767225612400000000",
                    "encoder_id": "mini-1",
                    "text_space": "minilm",
                    "cell_size_m": 0.1,
                    "cells_observed": 8132,
                    "frames_fused": 412,
                    "problem": "",
                }
            ]
        }
    )

    name: str
    file_bytes: int
    saved_at: Time
    saved_ns: Nanoseconds
    encoder_id: str
    text_space: str
    cell_size_m: float
    cells_observed: int
    frames_fused: int
    problem: str = Field(description="Why the file cannot be loaded; empty if nothing is wrong.")


class MapListReply(BaseModel):
    """The maps in the mapper's map folder, newest first."""

    maps: list[SavedMapReport]
    left_out: int = Field(description="Older maps that one reply cannot hold; usually 0.")


class MapInfo(BaseModel):
    """The map in numbers."""

    revision: int = Field(description="Counts every change of the map.")
    age_s: float | None = Field(description="Age of the newest frame in the map; null if empty.")
    bounds_m: tuple[float, float, float, float] = Field(
        description="x_min, y_min, x_max, y_max in metres."
    )
    cell_size_m: float
    free_m2: float
    occupied_m2: float
    observed_m2: float
    frames_fused: int
    memory_bytes: int
    update_ms: float
    rate_hz: float
    encoder_id: str
    text_space: str


class ServiceReport(BaseModel):
    """One service, or the robot, as seen from the gateway."""

    name: str
    condition: str = Field(description="ok, degraded or down.")
    problem: str = Field(description="One sentence; empty when all is well.")
    alive: bool = Field(description="Its process is connected now; for the robot: it sends.")
    ready: bool
    heartbeat_age_s: float | None
    metrics: dict[str, float | None]


class StreamReport(BaseModel):
    """One stream of messages as it reaches the gateway."""

    name: str
    age_s: float | None = Field(description="Since the last message; null: none yet.")
    rate_hz: float
    received: int
    missed: int = Field(description="Gaps in the sequence numbers; a slow stage skips.")
    skipped: int = Field(description="Replaced by a newer one before the gateway looked.")
    refused: int = Field(description="Could not be decoded.")
    last_problem: str = Field(description="Why the last one was refused.")


class LatencyReport(BaseModel):
    """How long frames took from the gateway to a stage's result, the newest 200 of them."""

    stage: str = Field(description="map, detections or command: the first that rests on a frame.")
    p50_s: float
    p95_s: float
    count: int = Field(description="Of frames that were timed since the gateway started.")


class StatusReport(BaseModel):
    """Every service and stream."""

    ready: bool = Field(description="As /readyz.")
    problem: str = Field(description="The reason why not.")
    services: list[ServiceReport]
    streams: list[StreamReport]
    latencies: list[LatencyReport]


class RobotReport(BaseModel):
    """One of several robots behind this gateway."""

    name: str
    namespace: str = Field(description="Prefix of its keys on the bus.")
    address: str = Field(description="What this document's addresses begin with for this robot.")
    ready: bool = Field(description="As /readyz.")
    problem: str = Field(description="The reason why not; empty when all is well.")
    services: list[str] = Field(description="Those of its processes that are connected now.")


class RobotList(BaseModel):
    """The robots of ``gateway.robots``."""

    robots: list[RobotReport]


class HealthReply(BaseModel):
    """Liveness of the gateway, or readiness of the whole robot."""

    status: str = Field(examples=["ok"])
