"""What a gateway replies, declared once: the gateway sends these models, the client returns them.

Places are metres in the frame of the map: x forward from where the robot started, y to its left.
Members that an older gateway leaves out have defaults; those that a newer one adds are in
``document`` only.
Values of closed lists (``state``, ``outcome``, ``kind``, ``order``, ``verdict``, ``reason_code``)
are plain texts, so that a value which this version does not know can be read.
"""

from __future__ import annotations

from collections.abc import Mapping
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

FINAL_STATES = (
    *("found", "found_other", "not_found", "failed", "cancelled", "arrived", "interrupted"),
)
DECIMALS = 3  # of lengths in metres: millimetres
RECEIVED = "received"  # context of a validation of JSON that a gateway sent
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
Rounded = Annotated[float, AfterValidator(lambda value: round(value, DECIMALS))]
Point = tuple[Rounded, Rounded]
Box = tuple[Rounded, Rounded, Rounded, Rounded]  # x_min, y_min, x_max, y_max
MaybePoint = Annotated[Point | None, EMPTY]
ReasonCode = Annotated[str | None, EMPTY, Field(description="Why it failed; null unless it did.")]


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


class ChoiceOption(Reply):
    """A goal that the planner weighed."""

    kind: str = Field(description="frontier, region, detection, go_to or look_at.")
    xy_m: Point = Field(description="x, y of where the robot would stand.")
    score: Rounded = Field(description="Similarity expected there, 0 to 1; 0 for a place.")
    travel_m: Rounded = Field(description="Metres of way to there.")
    utility: Rounded = Field(description="Goals are ranked by it: score and size less the way.")
    chosen: bool = Field(description="Whether the robot drives there.")


class Choice(Reply):
    """Where the robot drives, and why."""

    number: int = Field(description="Counts the decisions of the search, from 1.")
    sentence: str = Field(description="What the robot does and why, as in `reason`.")
    options: tuple[ChoiceOption, ...] = Field(
        description="The best of the goals that were weighed, at most 5, the chosen one among them."
    )
    left_out: int = Field(default=0, description="Goals that were weighed and are not listed.")


class SearchCoverage(Reply):
    """What a search that found nothing has looked at."""

    explored_m2: Rounded = Field(description="Free floor that was seen well enough.")
    free_m2: Rounded = Field(description="Free floor that was seen at all.")
    unreachable_m2: Rounded = Field(description="Free floor that no way leads to.")
    best_match_m: MaybePoint = Field(
        description="x, y of where the map resembles the object most; null without features."
    )
    best_score: Rounded = Field(description="Similarity there, 0 to 1.")


class FindEvidence(Reply):
    """In what an object was seen; its picture is at `/v1/objects/{id}.jpg`."""

    frame_ns: Nanoseconds = Field(
        description="Capture time of the frame; a string, as all nanoseconds."
    )
    box_px: Annotated[Box | None, EMPTY] = Field(
        description="x_min, y_min, x_max, y_max in that frame; null if there is none."
    )
    cells: int = Field(description="Cells of the map that support it.")


class ObjectOutcome(Reply):
    """How the search for one object, or the drive to the place, ended."""

    name: str = Field(description="Of the object; empty for a place.")
    outcome: str
    reason: str = ""
    position_m: Annotated[tuple[Rounded, Rounded, Rounded] | None, EMPTY] = Field(
        default=None, description="x, y, z; null: not found."
    )
    score: float = 0.0
    duration_s: float = 0.0
    path_length_m: Rounded = 0.0
    start_xy_m: MaybePoint = None
    end_xy_m: MaybePoint = None
    reason_code: ReasonCode = None
    coverage: SearchCoverage | None = Field(default=None, description="If it was not found.")
    evidence: FindEvidence | None = Field(default=None, description="If something was found.")
    checks: tuple[str, ...] = Field(
        default=(),
        description="What of its description holds and what was not checked, a sentence each.",
    )

    @property
    def found(self) -> bool:
        """Whether the object was found."""
        return self.outcome == "found"


class SearchSnapshot(Reply):
    """Progress of a search; ``state`` is that of the object now sought, or the final one."""

    id: str
    kind: str = "find"
    continues: str = Field(
        default="", description="Id of the ended search whose rest it is; empty: of none."
    )
    place_m: MaybePoint = Field(
        default=None,
        description="x, y of the place to drive to or to look at, metres; null for objects.",
    )
    state: str
    objects: tuple[str, ...] = Field(description="What is to be found; empty for a place.")
    understood: str = Field(default="", description="How the objects were; empty for a place.")
    left: tuple[str, ...] = Field(default=(), description="Not found so far, to search again.")
    index: int = Field(default=0, description="Which of the objects is now sought, from 0.")
    target: str = Field(
        default="",
        description="The object now sought; empty when the search is over or for a place.",
    )
    reason: str = Field(default="", description="In a sentence, what is going on or why it ended.")
    reason_code: ReasonCode = None
    results: tuple[ObjectOutcome, ...] = Field(
        description="Of the objects that are done, in the order of the request."
    )
    choice: Choice | None = Field(
        default=None, description="Where the robot drives, and why; null while it has no goal."
    )
    elapsed_s: float = 0.0
    path_length_m: Rounded = 0.0
    started_ns: Nanoseconds = 0
    updated_ns: Nanoseconds = 0

    @computed_field  # type: ignore[prop-decorator]
    @property
    def active(self) -> bool:
        """Whether the search still runs."""
        return self.state not in FINAL_STATES

    @computed_field  # type: ignore[prop-decorator]
    @property
    def started_at(self) -> Time:
        return moment(self.started_ns)

    @computed_field  # type: ignore[prop-decorator]
    @property
    def updated_at(self) -> Time:
        return moment(self.updated_ns)

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


class SearchListReply(Reply):
    """The searches that the planner remembers or has recorded, newest first."""

    searches: tuple[SearchSnapshot, ...]
    left_out: int = Field(
        default=0, description="Older searches that one reply cannot hold; usually 0."
    )


class ReplayStep(Reply):
    """A step of a past search: its state changed, or a goal was chosen."""

    elapsed_s: Rounded
    state: str
    target: str = Field(description="The object sought then; empty at the end or for a place.")
    reason: str = Field(description="In a sentence, what happened and why.")
    robot_m: MaybePoint = Field(default=None, description="x, y of the robot; null: not known.")
    goal_kind: str = Field(default="", description="As of an option of `choice`.")
    goal_m: MaybePoint = Field(default=None, description="x, y of the goal; null: there was none.")


class SearchReplay(Reply):
    """What was recorded of a search: its steps, and where the robot was."""

    search: SearchSnapshot
    steps: tuple[ReplayStep, ...] = Field(description="At most about 300.")
    left_out: int = Field(
        default=0,
        description="Steps that one reply cannot hold: some between two changes of the state.",
    )
    path_m: tuple[tuple[Rounded, Rounded, Rounded], ...] = Field(
        description="Seconds since the search began, x, y of the robot; at most 2000, every 0.25 m "
        "or more, and where the robot was at each step."
    )


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

    id: str
    name: str = Field(description="As it was searched for when it was last found.")
    position_m: tuple[Rounded, Rounded, Rounded] = Field(
        description="x, y, z of its middle in the map frame, metres."
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
        description="Objects that are not kept any more, because others took their room.",
    )


class MapPose(Reply):
    """Where something stands in the map frame, and where it faces."""

    x_m: Rounded
    y_m: Rounded
    yaw_rad: Rounded = Field(description="0 faces along x, positive is to the left.")


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


class ScoreGrid(Reply):
    """The score of every cell: ``scores[ix][iy]``, x to the right, y up, null: not observed."""

    cell_size_m: float
    origin_m: Point = Field(description="x, y of the lower left corner of [0][0].")
    shape: tuple[int, int]
    scores: tuple[tuple[float | None, ...], ...]


class QueryResult(Reply):
    """Whether it is on the map, and ranked regions that look like it, best first.

    What scores below the encoder's floor is left out; ``message`` then says so.
    """

    text: str = Field(description="As it was asked; `image` where an image was.")
    understood: str = Field(default="", description="How the text was; empty of an image.")
    stands_for: tuple[str, ...] = Field(default=(), description="Names nearest to a description.")
    verdict: str = Field(
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
    grid: ScoreGrid | None = None

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
