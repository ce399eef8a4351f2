"""What a gateway replies about searches, in metres of the map frame."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, computed_field

from onemap.replies import (
    EMPTY,
    Box,
    MaybePoint,
    Nanoseconds,
    Point,
    Reply,
    Rounded,
    Time,
    examples,
    moment,
    one_of,
)

FINAL_STATES = (
    *("found", "not_found", "failed", "cancelled", "arrived", "interrupted", "found_other"),
)
STATES = ("exploring", "approaching", "confirming", "returning", *FINAL_STATES)
REASONS = {  # why a search fails: its code and what that means
    "time_limit": "The time limit of the search, or of one object, was reached.",
    "distance_limit": "The robot drove as far as the search allows.",
    "stuck": "The robot cannot get away from where it stands.",
    "no_input": "Odometry or map were missing, or too old to act on, for too long.",
    "unreachable": "No way leads to the place, or to a view of it.",
    "unknown_word": "The encoder of the map does not know the word.",
    "map_refused": "The map cannot answer for this name.",
}
State = Annotated[str, one_of(STATES)]
ReasonCode = Annotated[
    Annotated[str, one_of(REASONS)] | None,
    EMPTY,
    Field(
        description="Why it failed; null unless it did. "
        + " ".join(f"`{code}`: {sentence}" for code, sentence in REASONS.items())
    ),
]


class ChoiceOption(Reply):
    """A goal that the planner weighed."""

    kind: str = Field(description="frontier, region, detection, outline, go_to or look_at.")
    xy_m: Point = Field(description="x, y of where the robot would stand.")
    score: Rounded = Field(description="Similarity expected there, 0 to 1; 0 for a place.")
    travel_m: Rounded = Field(description="Metres of way to there.")
    utility: Rounded = Field(
        description="Goals are ranked by it: the score, less for a longer way."
    )
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
    outcome: State
    reason: str = ""
    position_m: Annotated[tuple[Rounded, Rounded, Rounded] | None, EMPTY] = Field(
        default=None, description="x, y, z; null: not found."
    )
    where: str = Field(
        default="",
        description="What was found, in words, by room and landmark, as 'in the living room, next "
        "to the desk'; empty: the map knows none there, or has forgotten the find.",
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


EXPLORING = """{
    "id": "8f14e45f", "state": "exploring", "objects": ["sofa", "kettle"], "target": "sofa",
    "reason": "going to the unexplored space 2 m ahead to the right: it is the nearest",
    "results": [],
    "choice": {
        "number": 3,
        "sentence": "going to the unexplored space 2 m ahead to the right: it is the nearest",
        "options": [
            {"kind": "frontier", "xy_m": [1.8, -0.4], "score": 0.55, "travel_m": 1.2,
            "utility": 0.52, "chosen": true},
            {"kind": "region", "xy_m": [4.1, 0.3], "score": 0.61, "travel_m": 5,
            "utility": 0.41, "chosen": false}
        ]
    },
    "elapsed_s": 12.4, "path_length_m": 3.2, "started_ns": 1767225600000000000,
    "updated_ns": 1767225612400000000
}"""


class Passed(Reply):
    """A thing of the object's name that the search leaves aside."""

    position_m: Point = Field(description="x, y of it.")
    reason: str = Field(
        description="Why, in words, as 'not in the living room: it is in the bedroom'."
    )


class SearchSnapshot(Reply):
    """Progress of a search; ``state`` is that of the object now sought, or the final one."""

    model_config = examples(EXPLORING)

    id: str
    kind: Annotated[str, one_of(("find", "go_to", "look_at"))] = "find"
    continues: str = Field(
        default="", description="Id of the ended search that it continues; empty: none."
    )
    place_m: MaybePoint = Field(
        default=None,
        description="x, y of the place to drive to or to look at, metres; null for objects.",
    )
    state: State
    objects: tuple[str, ...] = Field(description="What is to be found; empty for a place.")
    requests: tuple[str, ...] = Field(
        default=(),
        description="The objects with all that was said of each, as 'red chair in the kitchen'.",
    )
    understood: str = Field(
        default="", description="The objects as they were understood; empty for a place."
    )
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
    passed: tuple[Passed, ...] = Field(
        default=(),
        description="Things of the name of the object now sought that are left aside, the newest "
        "last; at most 10.",
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
        if self.target and self.index < len(self.requests):
            return self.requests[self.index]
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
    state: State
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
