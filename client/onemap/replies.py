"""What a gateway replies, declared once: the gateway sends these models, the client returns them.

Of searches: ``search_replies``; of places: ``place_replies``.

Places are metres in the frame of the map: x forward from where the robot started, y to its left.
Members that an older gateway leaves out have defaults; those that a newer one adds are in
``document`` only.
Values of closed lists, such as a ``state``, are plain texts, so that a value which this version
does not know can be read.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import datetime, timedelta, timezone
from typing import Annotated, Any, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    PlainSerializer,
    PrivateAttr,
    ValidationInfo,
    WithJsonSchema,
    computed_field,
    model_validator,
)
from typing_extensions import Self

R = TypeVar("R", bound="Reply")

DECIMALS = 3  # of lengths in metres: millimetres
RECEIVED = "received"  # context of a validation of JSON that a gateway sent
VERDICTS = ("found", "not_here", "not_looked_yet")
HOLDS = ("yes", "no", "not_checked", "not_known")
EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
EMPTY = BeforeValidator(lambda value: value or None)  # messages of the bus have () and "" for none


def moment(time_ns: int) -> datetime:
    """Nanoseconds since 1970 as a time in UTC, cut to microseconds."""
    return EPOCH + timedelta(microseconds=time_ns // 1000)


def rfc3339(time: datetime) -> str:
    """A time in UTC as in RFC 3339, cut to milliseconds."""
    return f"{time:%Y-%m-%dT%H:%M:%S}.{time.microsecond // 1000:03d}Z"


TIME_SCHEMA = {
    "type": "string",
    "format": "date-time",
    "description": "RFC 3339, in UTC, cut to milliseconds.",
}
Time = Annotated[
    datetime,
    PlainSerializer(rfc3339, return_type=str, when_used="json"),
    WithJsonSchema(TIME_SCHEMA),
]
Nanoseconds = Annotated[
    int,
    PlainSerializer(str, return_type=str, when_used="json"),
    WithJsonSchema(
        {
            "type": "string",
            "pattern": "^[0-9]+$",
            "description": "Nanoseconds since 1970; a string, because JavaScript rounds such "
            "numbers.",
        }
    ),
]


def one_of(values: Iterable[str]) -> Any:
    """A closed list of texts, for the schema alone."""
    return Field(json_schema_extra={"enum": [*values]})


Rounded = Annotated[float, AfterValidator(lambda value: round(value, DECIMALS))]
Point = tuple[Rounded, Rounded]
Box = tuple[Rounded, Rounded, Rounded, Rounded]  # x_min, y_min, x_max, y_max
MaybePoint = Annotated[Point | None, EMPTY]


def examples(*given: str) -> ConfigDict:
    """For the schema: the documents of replies with the members of these JSON objects."""

    def add(schema: dict[str, Any], model: type[Reply]) -> None:
        schema["examples"] = [model.model_validate_json(members).document for members in given]

    return ConfigDict(json_schema_extra=add)


class Reply(BaseModel):
    """Base of everything a gateway replies: frozen; equal if its members are."""

    model_config = ConfigDict(
        frozen=True, from_attributes=True, json_schema_serialization_defaults_required=True
    )
    _document: dict[str, Any] | None = PrivateAttr(default=None)

    @classmethod
    def of(cls: type[R], document: Mapping[str, Any]) -> R:
        """The reply that a JSON object holds; ValueError if it holds none."""
        return cls.model_validate(document, context=RECEIVED)

    @model_validator(mode="wrap")
    @classmethod
    def _keep_document(
        cls, value: Any, handler: ModelWrapValidatorHandler[Self], info: ValidationInfo
    ) -> Self:
        reply = handler(value)
        if info.context is RECEIVED:
            reply._document = value
        return reply

    @property
    def document(self) -> dict[str, Any]:
        """The JSON object as it came, with members that this version does not know."""
        return self.model_dump(mode="json") if self._document is None else self._document

    def __eq__(self, other: object) -> bool:
        """Whether all members that this version knows are equal."""
        return type(self) is type(other) and self.__dict__ == other.__dict__


class MapContent(Reply):
    """What the map holds after it was saved, loaded, merged or cleared."""

    path: str = Field(description="Where the file lies on the mapper's machine; empty if none.")
    encoder_id: str = ""
    text_space: str = ""
    cell_size_m: float = 0.0
    cells_observed: int
    frames_fused: int
    file_bytes: int
    places_stayed: tuple[str, ...] = Field(
        default=(),
        description="Places that stay as they were, though the merged map has others so named.",
    )


class StoredMap(Reply):
    """A map in the mapper's map folder; without content if its file cannot be read."""

    model_config = examples(
        """{"name": "flat", "file_bytes": 2514932, "saved_ns": 1767225612400000000,
        "encoder_id": "mini-1", "text_space": "minilm", "cell_size_m": 0.1, "cells_observed": 8132,
        "frames_fused": 412, "problem": ""}"""
    )

    name: str
    file_bytes: int
    saved_ns: Nanoseconds
    encoder_id: str
    text_space: str = ""
    cell_size_m: float = 0.0
    cells_observed: int
    frames_fused: int = 0
    problem: str = Field(description="Why the file cannot be loaded; empty if nothing is wrong.")

    @computed_field  # type: ignore[prop-decorator]
    @property
    def saved_at(self) -> Time:
        return moment(self.saved_ns)


class MapListReply(Reply):
    """The maps in the mapper's map folder, newest first."""

    maps: tuple[StoredMap, ...]
    left_out: int = Field(
        default=0, description="Older maps that one reply cannot hold; usually 0."
    )


class MapStatistics(Reply):
    """The map in numbers."""

    revision: int = Field(description="Counts every change of the map.")
    age_s: float | None = Field(description="Age of the newest frame in the map; null if empty.")
    bounds_m: Box = Field(description="x_min, y_min, x_max, y_max in metres.")
    cell_size_m: float = 0.0
    free_m2: float
    occupied_m2: float
    observed_m2: float
    frames_fused: int = 0
    memory_bytes: int = 0
    update_ms: float = 0.0
    rate_hz: float = 0.0
    encoder_id: str = ""
    text_space: str = ""


class MapObject(Reply):
    """An object that was found, kept with the map."""

    model_config = examples(
        """{"id": "3f9a12c4", "name": "bed", "position_m": [3.42, -1.15, 0.41],
        "where": "in the bedroom, next to the wardrobe",
        "extent_m": [2.5, -2.1, 4.4, -0.3], "height_m": [0.1, 0.7], "score": 0.93,
        "times_found": 2, "search_id": "8f14e45f", "first_found_ns": 1767225612400000000,
        "last_seen_ns": 1767226191000000000, "box_px": [120, 184.5, 512, 402],
        "picture": "/v1/objects/3f9a12c4.jpg"}"""
    )

    id: str
    name: str = Field(description="As it was searched for when it was last found.")
    position_m: tuple[Rounded, Rounded, Rounded] = Field(
        description="x, y, z of its middle in the map frame, metres."
    )
    where: str = Field(
        default="",
        description="In words, by room and landmark: 'in the living room, next to the desk'; "
        "empty: the map knows none there.",
    )
    extent_m: Box = Field(
        description="x_min, y_min, x_max, y_max of the cells that it was seen on, metres."
    )
    height_m: MaybePoint = Field(
        default=None,
        description="Between which heights above the floor it lies, such as on a table or under "
        "it; null: not known.",
    )
    score: float = Field(description="Similarity of the map where it was found, 0 to 1.")
    times_found: int = Field(description="How many searches found it there.")
    search_id: str = Field(default="", description="The newest of these searches.")
    robot: str = Field(
        default="",
        description="Namespace of the robot that found it last, as in /v1/robots; empty: it has "
        "none, or a map of an older version was loaded.",
    )
    first_found_ns: Nanoseconds
    last_seen_ns: Nanoseconds
    box_px: Annotated[Box | None, EMPTY] = Field(
        default=None,
        description="x0, y0, x1, y1 of the object in pixels of the picture; null: not known.",
    )
    picture: str | None = Field(
        default=None,
        description="Address of the JPEG in which it was seen best; null: there is none.",
    )

    @computed_field  # type: ignore[prop-decorator]
    @property
    def first_found_at(self) -> Time:
        return moment(self.first_found_ns)

    @computed_field  # type: ignore[prop-decorator]
    @property
    def last_seen_at(self) -> Time:
        """When the picture was taken, by the robot's clock."""
        return moment(self.last_seen_ns)

    @property
    def has_picture(self) -> bool:
        """Whether ``Client.object_picture`` has one."""
        return self.picture is not None


class ObjectListReply(Reply):
    """The objects that were found, the one found last first."""

    objects: tuple[MapObject, ...]
    left_out: int = Field(
        default=0,
        description="Objects that are no longer kept, because newer ones took their place.",
    )


class MapPose(Reply):
    """Where something stands in the map frame, and where it faces."""

    x_m: Rounded
    y_m: Rounded
    yaw_rad: Rounded = Field(description="0 faces along x, positive is to the left.")


class ConditionReply(Reply):
    """Something that was said of an object besides its name, checked for one thing."""

    what: str = Field(description="As it is said: 'next to a bed'.")
    holds: Annotated[str, one_of(HOLDS)] = Field(
        description="not_checked: a closer look may tell; not_known: none will, as of a place that "
        "the map does not show."
    )
    evidence: str = Field(description="How it is known, or what is the matter, in words.")


class Region(Reply):
    """A region of the map that looks like the text."""

    rank: int = Field(description="1 is the best.")
    centre_m: Point = Field(description="x, y in the map frame, metres.")
    extent_m: Box = Field(description="x_min, y_min, x_max, y_max in metres.")
    outline_m: tuple[Point, ...] = Field(
        default=(),
        description="Corners of the polygon around its cells, counter-clockwise, metres.",
    )
    score: float = Field(description="Mean score of its best cells, 0 to 1.")
    variance: float | None = Field(
        default=None, description="Variance of the belief there; null: unbounded."
    )
    height_m: Point | None = Field(
        default=None,
        description="Between which heights above the floor the match lies, such as on a table or "
        "under it; null: not known, as in a map of an old file.",
    )
    last_seen_at: Annotated[str, WithJsonSchema(TIME_SCHEMA)] | None = Field(
        default=None,
        description="When a camera last saw it, by the robot's clock; null: not known, as in a map "
        "of an old file.",
    )
    best_view: MapPose | None = Field(
        default=None, description="Where the camera was when it saw it best; null: as above."
    )
    where: str = Field(
        default="",
        description="In words, by room and landmark: 'in the living room, next to the desk'; "
        "empty: the map knows none here.",
    )
    picture: str | None = Field(
        default=None,
        description="Address of the JPEG in which a search found it here; null: there is none.",
    )
    conditions: tuple[ConditionReply, ...] = Field(
        default=(), description="What was said of it besides its name, each with its verdict."
    )


class LookedArea(Reply):
    """How much of the reachable area was looked at, or of the part of it that was asked for."""

    share: Rounded = Field(default=0.0, description="0 to 1.")
    looked_m2: float = 0.0
    not_looked_m2: float = Field(
        default=0.0, description="Seen from too far or too briefly, or hidden behind a frontier."
    )
    frontiers: int = Field(
        default=0, description="Borders of the known floor behind which nobody looked."
    )
    frontier_m: MaybePoint = Field(
        default=None, description="x, y of the one to look behind next; null if there is none."
    )


FOUND = """{
    "text": "where is the sofa?", "request": "sofa", "understood": "sofa, anywhere",
    "verdict": "found",
    "sentence": "'sofa' is in the living room, next to the desk, at (2.35, -1.10) m.",
    "regions": [{
        "rank": 1, "centre_m": [2.35, -1.1], "extent_m": [1.5, -1.6, 3.2, -0.6],
        "outline_m": [[1.5, -1.6], [3.2, -1.6], [3.2, -0.6], [1.5, -0.6]],
        "score": 0.91, "variance": 0.04, "height_m": [0.1, 0.9],
        "last_seen_at": "2026-01-01T00:00:12.400Z",
        "best_view": {"x_m": 0.6, "y_m": -0.4, "yaw_rad": -0.38},
        "where": "in the living room, next to the desk", "picture": "/v1/objects/3f9a12c4.jpg"
    }],
    "looked": {"share": 0.62, "looked_m2": 31.5, "not_looked_m2": 19.3, "frontiers": 4,
        "frontier_m": [5.15, 0.45]},
    "revision": 412, "age_s": 0.21, "encoder_id": "mini-1", "best_score": 0.91, "calibrated": true
}"""
ABSENT = """{
    "text": "piano", "verdict": "not_looked_yet",
    "sentence": "'piano' was not seen, but only 62 % of the reachable area was looked at; look \
next beyond the edge of the map at (5.15, 0.45) m.",
    "regions": [],
    "looked": {"share": 0.62, "looked_m2": 31.5, "not_looked_m2": 19.3, "frontiers": 4,
        "frontier_m": [5.15, 0.45]},
    "revision": 412, "age_s": 0.21, "encoder_id": "mini-1", "best_score": 0.04, "calibrated": true,
    "message": "Nothing on the map looks like 'piano': the best score is 0.04, and answers begin \
at 0.22."
}"""


class QueryResult(Reply):
    """Whether it is on the map, and ranked regions that look like it, best first.

    What scores below the encoder's floor is left out; ``message`` then says so.
    """

    model_config = examples(FOUND, ABSENT)

    text: str = Field(description="As it was asked; `image` for an image.")
    request: str = Field(
        default="",
        description="What is asked for, without the words around it, as 'red chair in the "
        "kitchen' of 'where is the red chair in the kitchen?'; empty for an image.",
    )
    understood: str = Field(
        default="", description="The text as it was understood; empty for an image."
    )
    stands_for: tuple[str, ...] = Field(default=(), description="Names nearest to a description.")
    verdict: Annotated[str, one_of(VERDICTS)] = Field(
        default="",
        description="`found`, `not_here`: the reachable area was looked at without finding it, or "
        "`not_looked_yet`.",
    )
    sentence: str = Field(default="", description="The verdict in words.")
    regions: tuple[Region, ...]
    looked: LookedArea = LookedArea()
    revision: int = Field(default=0, description="Counts every change of the map.")
    age_s: float | None = Field(
        default=None, description="Age of the newest frame in the map; null if empty."
    )
    encoder_id: str = ""
    best_score: float = Field(
        default=0.0, description="Of the best region, also if it was left out."
    )
    calibrated: bool = Field(
        default=False,
        description="Whether scores are probabilities; if not, as of an image or of an encoder "
        "without a calibration, only their order means anything.",
    )
    message: str = Field(default="", description="Why there are no regions; empty if there are.")

    @property
    def found(self) -> bool:
        """Whether it is on the map; without a verdict, of an older gateway: if it has regions."""
        return self.verdict == "found" if self.verdict else bool(self.regions)


class QueryListReply(Reply):
    """The answers to several texts, in their order."""

    answers: tuple[QueryResult, ...]


class ServiceHealth(Reply):
    """One service, or the robot, as seen from the gateway."""

    name: str
    condition: str = Field(description="ok, degraded or down.")
    problem: str = Field(description="One sentence; empty when all is well.")
    alive: bool = Field(
        default=False, description="Its process is connected now; for the robot: it sends."
    )
    ready: bool = False
    heartbeat_age_s: float | None = None
    version: str = Field(default="", description="Of OneMap; empty for a driver without it.")
    metrics: Mapping[str, float | None] = {}


class StreamHealth(Reply):
    """One stream of messages as it reaches the gateway."""

    name: str
    age_s: float | None = Field(description="Since the last message; null: none yet.")
    rate_hz: float
    received: int = 0
    missed: int = Field(default=0, description="Gaps in the sequence numbers; a slow stage skips.")
    skipped: int = Field(
        default=0, description="Replaced by a newer one before the gateway looked."
    )
    refused: int = Field(default=0, description="Could not be decoded.")
    last_problem: str = Field(default="", description="Why the last one was refused.")


class StageLatency(Reply):
    """How long frames took from the gateway to a stage's result, the newest 200 of them."""

    stage: str = Field(description="map, detections or command: the first that rests on a frame.")
    p50_s: Rounded
    p95_s: Rounded
    count: int = Field(description="Of frames that were timed since the gateway started.")


class SystemStatus(Reply):
    """Every service and stream; whether a search could start now."""

    ready: bool = Field(default=False, description="As /readyz.")
    problem: str = Field(default="", description="The reason why not.")
    services: tuple[ServiceHealth, ...] = ()
    streams: tuple[StreamHealth, ...] = ()
    latencies: tuple[StageLatency, ...] = ()
