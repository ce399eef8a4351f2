"""Messages of the planner: searches, why it drives where, how it ended, the planned path."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import Annotated, TypeAlias

from onemap_shared.geometry import F32, MAX_COORDINATE_M
from onemap_shared.messages.checks import (
    Count,
    Finite,
    Message,
    Shape,
    Word,
    cleaned,
    finite,
    items,
    numbers,
    within,
)
from onemap_shared.messages.details import NO_DETAIL, Detail
from onemap_shared.messages.places import MAX_PLACES

MAX_GOAL_OPTIONS = 5  # of one choice: the best, and the chosen one


@dataclass(frozen=True, slots=True)
class GoalOption(Message):
    """A goal that was weighed.

    Attributes:
        kind: frontier, region, detection, outline, go_to or look_at.
        xy_m: x, y in the map frame of where the robot would stand, the end of its way.
        score: similarity expected there, in [0, 1]; 0 for a place.
        travel_m: metres of way to there.
        utility: what goals are ranked by, in units of similarity: score and size less the way.
        chosen: whether the robot drives there.
    """

    kind: str
    xy_m: Annotated[tuple[float, float], numbers(2)]
    score: Finite
    travel_m: Finite
    utility: Finite
    chosen: bool


@dataclass(frozen=True, slots=True)
class GoalChoice(Message):
    """A decision of the planner where to drive.

    Attributes:
        number: counts the decisions of a search, from 1; 0 before the first.
        sentence: why the chosen goal won; empty while the robot has no goal.
        options: at most 5 of the goals that were weighed, best first, the chosen one among them.
        left_out: number of goals that were weighed and are not in ``options``.
    """

    number: int = 0
    sentence: str = ""
    options: Annotated[tuple[GoalOption, ...], items(MAX_GOAL_OPTIONS)] = ()
    left_out: int = 0

    @property
    def chosen_xy(self) -> tuple[float, float] | None:
        """Where the robot drives, metres; None without a goal."""
        return next((option.xy_m for option in self.options if option.chosen), None)


NO_CHOICE = GoalChoice()


class FailureCode(Word):
    """Why a search failed: the closed list; empty for what did not fail."""

    NONE = ""
    TIME_LIMIT = "time_limit"
    DISTANCE_LIMIT = "distance_limit"
    STUCK = "stuck"
    NO_INPUT = "no_input"
    UNREACHABLE = "unreachable"
    UNKNOWN_WORD = "unknown_word"
    MAP_REFUSED = "map_refused"


@dataclass(frozen=True, slots=True)
class Coverage:
    """What a search that found nothing has looked at.

    Attributes:
        explored_m2: free floor that was seen well enough, in square metres.
        free_m2: free floor that was seen at all.
        unreachable_m2: free floor with room for the robot that no path leads to.
        best_match_m: x, y of where the map resembles the object most; empty without features.
        best_score: similarity there, in [0, 1].
    """

    explored_m2: float = 0.0
    free_m2: float = 0.0
    unreachable_m2: float = 0.0
    best_match_m: tuple[float, ...] = ()
    best_score: float = 0.0


NO_COVERAGE = Coverage()


MAX_OBJECTS = 20  # objects of one search
MOTIONS = ("", "drive", "rotate", "reverse", "rest")  # of a planned path; empty: not known


class SearchKind(Word):
    """What a search is for: find objects, drive to a place, or drive to where it can be seen."""

    FIND = "find"
    GO_TO = "go_to"
    LOOK_AT = "look_at"


class After(Word):
    """What the robot does when a search is done: stay, or return to where it set out."""

    STAY = "stay"
    RETURN = "return"


class SearchState(Word):
    """States of a search; the last seven are final.

    ``returning``: all objects are done, and the robot drives back to where it set out;
    ``arrived``: only of a drive to a place; ``interrupted``: the planner that accepted it, or the
    driver that it was accepted for, has ended;
    ``found_other``: not what was described, but another object of its name.
    """

    EXPLORING = "exploring"
    APPROACHING = "approaching"
    CONFIRMING = "confirming"
    RETURNING = "returning"
    FOUND = "found"
    NOT_FOUND = "not_found"
    FAILED = "failed"
    CANCELLED = "cancelled"
    ARRIVED = "arrived"
    INTERRUPTED = "interrupted"
    FOUND_OTHER = "found_other"


FINAL_STATES = frozenset(tuple(SearchState)[4:])
ObjectNames: TypeAlias = Annotated[tuple[str, ...], cleaned("object name")]
Limit: TypeAlias = Annotated[float, within(0)]
Details: TypeAlias = Annotated[tuple[Detail, ...], items(MAX_OBJECTS)]
StayOut: TypeAlias = Annotated[tuple[str, ...], items(MAX_PLACES), cleaned("place")]


@dataclass(frozen=True, slots=True)
class SearchRequest(Message):
    """Request to find objects, or to drive to a place.

    Attributes:
        objects: 1 to 20 names; empty for a place.
        patience_s: seconds that the caller waits for the answer; no robot may start later.
        kind: what to do.
        place_m: x, y in the map frame, at most 100 km from its origin; empty for objects.
        max_distance_m: metres that the robot may drive in this search; 0: no limit.
        max_time_s: seconds that this search may take, with all its objects; 0: no limit.
        details: what is said of each of the objects besides its name; empty: nothing of any.
        stay_out: names of places that the robot does not enter during this search.
        continues: id of the ended search whose rest this is; empty: of none.
        after: what the robot does when all objects are done, found or not; of objects only.
        age_s: seconds since a person asked for it: a stop that came later holds for it too.
        place: name of the place to drive to, or ``back``: the planner knows where that is in the
            frame that it accepts the request in.
    """

    objects: ObjectNames
    patience_s: Annotated[float, within(0, above=True)] = 2.0
    kind: SearchKind = SearchKind.FIND
    place_m: tuple[float, ...] = ()
    max_distance_m: Limit = 0.0
    max_time_s: Limit = 0.0
    details: Details = ()
    stay_out: StayOut = ()
    continues: str = ""
    after: After = After.STAY
    age_s: Annotated[float, within(0)] = 0.0
    place: Annotated[str, cleaned("name of a place", optional=True)] = ""

    def aged(self, waited_s: float) -> SearchRequest:
        """The request after it waited for its turn."""
        left_s = max(self.patience_s - waited_s, 1e-3)
        return replace(self, age_s=self.age_s + waited_s, patience_s=left_s)

    def _check(self) -> None:
        if not self.place:
            _check_place(self.kind, self.place_m)
        elif self.place_m or self.kind is not SearchKind.GO_TO:
            raise ValueError(f"only a drive, without place_m, has a place's name: {self.place!r}")
        _check_details(self.objects, self.details)
        if self.after is not After.STAY and self.kind is not SearchKind.FIND:
            raise ValueError(f"a search of kind {self.kind} has after {self.after}; it only stays")
        if self.kind is not SearchKind.FIND:
            if self.objects:
                raise ValueError(f"a search of kind {self.kind} has objects; it has only a place")
            return
        if not 1 <= len(self.objects) <= MAX_OBJECTS:
            raise ValueError(
                f"a search has {len(self.objects)} objects; between 1 and {MAX_OBJECTS} are allowed"
            )


def _check_place(kind: SearchKind, place_m: tuple[float, ...]) -> None:
    """Raise ValueError unless ``place_m`` is a place that a search of this kind may have."""
    if kind is SearchKind.FIND:
        if place_m:
            raise ValueError(f"a search of kind {kind} has a place; it has only objects")
        return
    if len(place_m) != 2:
        raise ValueError(f"place_m has {len(place_m)} numbers; it must be x and y in metres")
    if not all(isfinite(value) and abs(value) <= MAX_COORDINATE_M for value in place_m):
        raise ValueError(
            f"place_m is {place_m}; x and y must lie within {MAX_COORDINATE_M:g} m of the origin: "
            "are their units metres?"
        )


def _check_details(objects: tuple[str, ...], details: tuple[Detail, ...]) -> None:
    """Raise ValueError unless there are as many details as objects, or none."""
    if details and len(details) != len(objects):
        raise ValueError(f"{len(details)} details for {len(objects)} objects; give one for each")


def subject_of(target: str, place_m: tuple[float, ...]) -> str:
    """An object or, if there is one, a place (x, y in metres) in words."""
    return f"the place ({place_m[0]:.2f}, {place_m[1]:.2f})" if place_m else repr(target)


@dataclass(frozen=True, slots=True)
class SearchId:
    """Names a search; an empty id means the newest."""

    search_id: str = ""


@dataclass(frozen=True, slots=True)
class ObjectResult:
    """How the search for one object, or the drive to the place, ended.

    Attributes:
        name: of the object; empty for a place.
        outcome: a final state.
        reason: why it ended, in one sentence.
        position_m: x, y, z of the object in the map frame, empty if not found.
        score: similarity of the map where it was found, in [0, 1]; 0 if not found.
        duration_s: seconds that the search for this object took.
        path_length_m: metres that the robot drove for it.
        start_xy_m: x, y of the robot when the search for it began; empty if not known.
        end_xy_m: x, y of the robot when it ended; empty if not known.
        reason_code: why it failed, one of a closed list; empty if it did not fail.
        coverage: what was looked at, if nothing was found.
        frame_ns: capture time of the frame in which it was seen best, 0 if not found.
        box_px: x_min, y_min, x_max, y_max of it in that frame, empty if not found.
        cells: number of map cells that support it; its picture is in the list of objects.
        checks: which part of its description holds and which was not checked, a sentence each.
        index: of the object in the request, as two may have one name; -1: not known.
    """

    name: str
    outcome: SearchState
    reason: str
    position_m: tuple[float, ...]
    score: float
    duration_s: float
    path_length_m: float
    start_xy_m: tuple[float, ...]
    end_xy_m: tuple[float, ...]
    reason_code: FailureCode = FailureCode.NONE
    coverage: Coverage = NO_COVERAGE
    frame_ns: int = 0
    box_px: tuple[float, ...] = ()
    cells: int = 0
    checks: tuple[str, ...] = ()
    index: int = -1


@dataclass(frozen=True, slots=True)
class PassedThing(Message):
    """A thing of the object's name that a search leaves aside.

    Attributes:
        position_m: x, y of it.
        reason: why, in words: "not in the living room: it is in the bedroom".
    """

    position_m: Annotated[tuple[float, float], numbers(2)]
    reason: str


MAX_PASSED = 10  # of one object, the newest


@dataclass(frozen=True, slots=True)
class SearchStatus(Message):
    """Status of a search.

    Attributes:
        state: of the present object; of the whole search when final.
        objects: the names, in the order of the request; empty for a place.
        index: of the present object in ``objects``.
        reason: what happens now or why it ended, in one sentence.
        results: of the objects that are done, in the order in which they ended.
        started_ns: when the search began, in nanoseconds of the planner's wall clock.
        updated_ns: when this status was made, by the same clock.
        path_length_m: metres that the robot drove in this search.
        kind: what the search is for.
        place_m: x, y of the place to drive to or to look at; empty for objects.
        choice: where the robot drives now, and why.
        details: of the objects, as requested.
        stay_out: as requested.
        max_distance_m: as requested.
        max_time_s: as requested.
        elapsed_s: seconds that it has run, by the planner's monotonic clock.
        continues: id of the ended search whose rest it is, as requested.
        passed: things of the present object's name that are left aside.
        after: as requested.
        start_m: x, y of the robot when it was accepted; empty: not known then.
    """

    search_id: str
    state: SearchState
    objects: ObjectNames
    index: int
    reason: str
    results: tuple[ObjectResult, ...]
    started_ns: int
    updated_ns: int
    path_length_m: float
    kind: SearchKind = SearchKind.FIND
    place_m: tuple[float, ...] = ()
    choice: GoalChoice = NO_CHOICE
    details: Details = ()
    stay_out: StayOut = ()
    max_distance_m: Limit = 0.0
    max_time_s: Limit = 0.0
    elapsed_s: Limit = 0.0
    continues: str = ""
    passed: Annotated[tuple[PassedThing, ...], items(MAX_PASSED)] = ()
    after: After = After.STAY
    start_m: Annotated[tuple[float, ...], numbers(2, optional=True)] = ()

    def _check(self) -> None:
        _check_place(self.kind, self.place_m)
        _check_details(self.objects, self.details)

    @property
    def active(self) -> bool:
        """Whether the search has not ended."""
        return self.state not in FINAL_STATES

    @property
    def target(self) -> str:
        """The object now searched for, empty when all are done, or of a place."""
        seeks = self.active and self.state is not SearchState.RETURNING
        return self.objects[self.index] if seeks and self.index < len(self.objects) else ""

    @property
    def left(self) -> tuple[int, ...]:
        """Indices of the objects that were not found."""
        found = {
            self.objects.index(each.name) if each.index < 0 else each.index
            for each in self.results
            if each.outcome is SearchState.FOUND and each.name in self.objects
        }
        return tuple(index for index in range(len(self.objects)) if index not in found)

    def again(self, patience_s: float) -> SearchRequest:
        """The request for what is left of it, or for its place; ValueError if all was found.

        Its limits count anew.
        """
        return SearchRequest(
            tuple(self.objects[index] for index in self.left),
            patience_s,
            kind=self.kind,
            place_m=self.place_m,
            max_distance_m=self.max_distance_m,
            max_time_s=self.max_time_s,
            details=tuple(self.details[index] for index in self.left) if self.details else (),
            stay_out=self.stay_out,
            continues=self.search_id,
            after=self.after,
        )

    @property
    def named(self) -> tuple[str, ...]:
        """The objects, and the anchors and negatives of the present one."""
        return (*self.objects, *self.detail.anchors, *self.detail.negatives)

    @property
    def detail(self) -> Detail:
        """What is said of the object now searched for, besides its name."""
        return self.details[self.index] if self.target and self.details else NO_DETAIL

    @property
    def reason_code(self) -> FailureCode:
        """Why the search failed: that of the last object that did; none unless it failed."""
        codes = [result.reason_code for result in self.results if result.reason_code]
        return codes[-1] if codes and self.state is SearchState.FAILED else FailureCode.NONE

    @property
    def subject(self) -> str:
        """What the search is for, in words: the present object as described, or the place."""
        return subject_of(self.detail.of(self.target) or ", ".join(self.objects), self.place_m)


@dataclass(frozen=True, slots=True)
class SearchListRequest:
    """Request for the searches that are remembered."""


@dataclass(frozen=True, slots=True)
class SearchList(Message):
    """The remembered searches, newest first.

    Attributes:
        searches: their status.
        left_out: number of older ones, too many for one message.
    """

    searches: tuple[SearchStatus, ...]
    left_out: Count = 0

    def _check(self) -> None:
        ids = [search.search_id for search in self.searches]
        if len(set(ids)) < len(ids):
            raise ValueError("a search is listed twice")


@dataclass(frozen=True, slots=True)
class SearchStep(Message):
    """A recorded step of a search: its state changed, or a goal was chosen.

    Attributes:
        elapsed_s: seconds since the search began.
        state: then.
        target: the object sought then; empty at the end, or for a place.
        reason: what happened and why, in one sentence.
        robot_m: x, y of the robot; empty if not known.
        goal_kind: of the goal that was chosen, as of ``GoalOption``; empty without a goal.
        goal_m: x, y of it; empty without a goal.
    """

    elapsed_s: Finite
    state: SearchState
    target: str
    reason: str
    robot_m: Annotated[tuple[float, ...], numbers(2, optional=True)]
    goal_kind: str
    goal_m: Annotated[tuple[float, ...], numbers(2, optional=True)]


@dataclass(frozen=True, slots=True)
class SearchRecord(Message):
    """What was recorded of a search, thinned: for a replay.

    Attributes:
        status: of the search now, or how it ended.
        steps: in their order.
        left_out: number of recorded steps that are not in ``steps``.
        places: (N, 3) seconds since the search began, x, y of the robot in metres.
    """

    status: SearchStatus
    steps: tuple[SearchStep, ...]
    left_out: Count
    places: Annotated[F32, Shape("N", 3), finite]


@dataclass(frozen=True, slots=True)
class PlannedPath(Message):
    """Path, goal, frontiers and regions of the last plan, for display.

    Places are in metres of the map frame, scores in [0, 1].

    Attributes:
        stamp_ns: when the plan was made, on the planner's wall clock.
        goal_kind: frontier, region, detection, outline, go_to, look_at or none.
        goal_reason: why this goal, in one sentence.
        points_m: (N, 2) the path, from the robot to the goal.
        goal_m: (G, 2) the goal: one row, none without a goal.
        frontiers_m: (F, 2) where the frontiers are.
        frontier_scores: (F,) their scores.
        regions_m: (R, 2) where the regions are.
        region_scores: (R,) their scores.
        motion: what the robot is to do: drive, rotate (left, where it stands), reverse, rest;
            empty: the planner does not say.
        look_m: x, y of what it faces at the end of the path; empty if it does not drive.
    """

    stamp_ns: int
    goal_kind: str
    goal_reason: str
    points_m: Annotated[F32, Shape("N", 2), finite]
    goal_m: Annotated[F32, Shape("G", 2), finite]
    frontiers_m: Annotated[F32, Shape("F", 2), finite]
    frontier_scores: Annotated[F32, Shape("F")]
    regions_m: Annotated[F32, Shape("R", 2), finite]
    region_scores: Annotated[F32, Shape("R")]
    motion: str = ""
    look_m: Annotated[tuple[float, ...], numbers(2, optional=True)] = ()

    def _check(self) -> None:
        if self.motion not in MOTIONS:
            raise ValueError(f"motion is {self.motion!r}; it must be one of {', '.join(MOTIONS)}")
