"""Where something is on the map: requests for regions that look like a text, replies, verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, TypeAlias

import numpy as np

from onemap_shared.geometry import F32, I32, I64, MAX_COORDINATE_M
from onemap_shared.grid import GridSpec
from onemap_shared.messages import checks
from onemap_shared.messages.details import (
    NO_DETAIL,
    CheckedCondition,
    Detail,
    Holds,
    Negatives,
    RelationKind,
    all_hold,
)
from onemap_shared.names import definite


class Verdict(checks.Word):
    """Whether an object is on the map; docs/queries.md has the rule."""

    FOUND = "found"
    NOT_HERE = "not_here"
    NOT_LOOKED_YET = "not_looked_yet"


@dataclass(frozen=True, slots=True)
class MapVerdict:
    """The verdict about one object, and how much of the reachable area was looked at.

    Attributes:
        verdict: one of the three.
        looked_m2: of the reachable area, in square metres.
        not_looked_m2: seen from too far or too briefly, or hidden behind a frontier.
        frontiers: borders of the known floor behind which nobody looked.
        frontier_m: x, y of the one to look behind next; empty if there is none.
    """

    verdict: Verdict = Verdict.NOT_LOOKED_YET
    looked_m2: float = 0.0
    not_looked_m2: float = 0.0
    frontiers: int = 0
    frontier_m: tuple[float, ...] = ()

    @property
    def looked_share(self) -> float:
        """Share of the area that was looked at, 0 to 1; 0 if there is none."""
        total_m2 = self.looked_m2 + self.not_looked_m2
        return self.looked_m2 / total_m2 if total_m2 > 0 else 0.0


NO_VERDICT = MapVerdict()


def _check_area(area_m: tuple[float, ...], name: str) -> None:
    """Raise ValueError unless x_min < x_max and y_min < y_max, not too far away, or empty."""
    if not area_m:
        return
    if len(area_m) != 4 or not np.abs(area_m).max() <= MAX_COORDINATE_M:  # also refuses NaN
        raise ValueError(
            f"{name} is {list(area_m)}; give x_min, y_min, x_max, y_max in metres, at most "
            f"{MAX_COORDINATE_M:g} from the origin"
        )
    if area_m[0] >= area_m[2] or area_m[1] >= area_m[3]:
        raise ValueError(f"{name} is {list(area_m)}; x_min < x_max and y_min < y_max must hold")


Sought: TypeAlias = Annotated[str, checks.cleaned()]
AreaM: TypeAlias = Annotated[tuple[float, ...], _check_area]
PointM: TypeAlias = Annotated[tuple[float, ...], checks.numbers(2, optional=True)]


@dataclass(frozen=True, slots=True)
class SimilarityRequest(checks.Message):
    """Request for the regions of the map most similar to a text.

    Attributes:
        text: what to look for.
        max_regions: number of regions in the reply, 1 to 100.
        include_grid: whether the reply carries the score of every cell.
        negatives: what it must not be: they compete with the text; at most 10.
        area_m: x_min, y_min, x_max, y_max of the part of the map that counts; empty: all of it.
        robot_xy_m: x, y of the robot, from which reachable is judged; empty: not known.
        detail: what is said of it besides its name.
    """

    text: Sought
    max_regions: Annotated[int, checks.within(1, 100)] = 5
    include_grid: bool = False
    negatives: Negatives = ()
    area_m: AreaM = ()
    robot_xy_m: PointM = ()
    detail: Detail = NO_DETAIL


@dataclass(frozen=True, slots=True)
class ImageSimilarityRequest(checks.Message):
    """Request for the regions of the map most similar to what a picture shows.

    Attributes:
        image: a PNG or JPEG of 16 to 4096 pixels on each side, at most 512 kB.
        query: the rest of the request; its text only names the image in the reply, and it has no
            negatives: features are more alike than a text and a feature, so that no text competes.
    """

    image: checks.Image
    query: SimilarityRequest

    def _check(self) -> None:
        if self.query.negatives:
            raise ValueError("an image has no negatives: texts do not compete with it")


@dataclass(frozen=True, slots=True)
class Whereabouts(checks.Message):
    """Where a region of an answer is, and whether it is as it was described.

    Attributes:
        room: name of the place that holds it; empty: none with a name.
        relation: how it lies to the landmark: next to it, on it or under it.
        landmark: name of a thing near it that was found, or that the map shows well; empty: none.
        object_id: of the found object that it is, which may have a picture; empty: none was found.
        conditions: what is said of it beside its name, each with its verdict.
    """

    room: str = ""
    relation: RelationKind = RelationKind.NEXT_TO
    landmark: str = ""
    object_id: str = ""
    conditions: tuple[CheckedCondition, ...] = ()

    @property
    def in_words(self) -> str:
        """As people say it: "in the living room, next to the desk"; empty: nothing is known."""
        parts = [f"in {definite(self.room)}"] if self.room else []
        parts += [f"{self.relation.words} {definite(self.landmark)}"] if self.landmark else []
        return ", ".join(parts)

    @property
    def holds(self) -> Holds:
        """Whether it is as it was described."""
        return all_hold(self.conditions)


@dataclass(frozen=True, slots=True)
class SimilarityReply(checks.Message):
    """Ranked regions of high similarity, best first, and the grid if it was requested.

    Attributes:
        text: the text of the request.
        centres_m: (N, 2) x, y of each region.
        extents_m: (N, 4) x_min, y_min, x_max, y_max of each region.
        scores: (N,) in [0, 1]; no region scores below ``floor``.
        variances: (N,) variance of the feature of each region.
        scores_grid: (nx, ny) score of each cell, NaN where nothing was observed; (0, 0) if not
            requested.
        best_score: of the best region before those below the floor were left out, 0 if nothing
            was observed.
        floor: the encoder's, 0 if it was not measured.
        outline_points_m: (P, 2) x, y of the corners of the regions' outlines, counter-clockwise,
            one region after the other.
        outline_owner: (P,) index of the region that a corner belongs to, ascending.
        last_seen_ns: (N,) when a camera last saw a cell of the region, on the robot's wall clock;
            0: nothing is known of it, as in a map of an old file.
        best_views: (N, 3) x, y and yaw in radians of the camera when it saw the region best; NaN:
            as 0 above.
        verdict: whether the object is on the map.
        heights_m: (N, 2) between which heights above the floor the match lies; NaN: not known.
        calibrated: whether the scores are probabilities; if not, only their order means anything.
        whereabouts: of each region; those that are as described come first. Empty: not known.
    """

    text: str
    revision: int
    stamp_ns: int
    encoder_id: str
    centres_m: Annotated[F32, checks.Shape("N", 2)]
    extents_m: Annotated[F32, checks.Shape("N", 4)]
    scores: Annotated[F32, checks.Shape("N")]
    variances: Annotated[F32, checks.Shape("N")]
    grid: GridSpec
    scores_grid: Annotated[F32, checks.Shape(None, None)]
    best_score: checks.Share = 0.0
    floor: checks.Share = 0.0
    outline_points_m: Annotated[F32, checks.Shape("P", 2)] = checks.without(np.float32, 0, 2)
    outline_owner: Annotated[I32, checks.Shape("P")] = checks.without(np.int32, 0)
    last_seen_ns: Annotated[I64, checks.Shape("N")] = checks.without(np.int64, 0)
    best_views: Annotated[F32, checks.Shape("N", 3)] = checks.without(np.float32, 0, 3)
    verdict: MapVerdict = NO_VERDICT
    heights_m: Annotated[F32, checks.Shape("N", 2)] = checks.without(np.float32, 0, 2)
    calibrated: bool = False
    whereabouts: tuple[Whereabouts, ...] = ()

    def _check(self) -> None:
        if self.whereabouts and len(self.whereabouts) != len(self.scores):
            raise ValueError(f"{len(self.whereabouts)} whereabouts for {len(self.scores)} regions")
        owner, count = self.outline_owner, len(self.scores)
        if len(owner) and not 0 <= owner.min() <= owner.max() < count:
            raise ValueError(f"outline_owner names a region beyond the {count} there are")
