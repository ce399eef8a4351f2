"""Where something is on the map: requests for regions that look like a text, replies, verdict."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from onemap_shared.geometry import F32, I32, I64, MAX_COORDINATE_M
from onemap_shared.grid import GridSpec
from onemap_shared.messages.checks import ADDED, check_image, clean_texts, expect, expect_share


class Verdict(str, Enum):
    """Whether an object is on the map; docs/queries.md has the rule."""

    FOUND = "found"
    NOT_HERE = "not_here"
    NOT_LOOKED_YET = "not_looked_yet"

    def __str__(self) -> str:
        return self.value


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


MAX_NEGATIVES = 10  # texts that compete with one text


@dataclass(frozen=True, slots=True)
class SimilarityRequest:
    """Request for the regions of the map most similar to a text.

    Attributes:
        text: what to look for.
        max_regions: number of regions in the reply, 1 to 100.
        include_grid: whether the reply carries the score of every cell.
        negatives: what it must not be: they compete with the text; at most 10.
        area_m: x_min, y_min, x_max, y_max of the part of the map that counts; empty: all of it.
        robot_xy_m: x, y of the robot, from which reachable is judged; empty: not known.
    """

    text: str
    max_regions: int = 5
    include_grid: bool = False
    negatives: tuple[str, ...] = ()
    area_m: tuple[float, ...] = ()
    robot_xy_m: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        _check_query(self)
        if not 1 <= self.max_regions <= 100:
            raise ValueError(f"max_regions is {self.max_regions}; it must lie in [1, 100]")
        if len(self.robot_xy_m) not in (0, 2) or not np.isfinite(self.robot_xy_m).all():
            raise ValueError(f"robot_xy_m is {self.robot_xy_m}; give x, y in metres, or nothing")


def _check_query(query: SimilarityRequest | AnsweredQuery) -> None:
    """Check texts and area, x_min < x_max and y_min < y_max not too far away; cleans the texts."""
    clean_texts(query, "text")
    clean_texts(query, "negatives", "negative")
    if len(query.negatives) > MAX_NEGATIVES:
        raise ValueError(f"{len(query.negatives)} negatives; at most {MAX_NEGATIVES} compete")
    area_m = query.area_m
    if not area_m:
        return
    if len(area_m) != 4 or not np.abs(area_m).max() <= MAX_COORDINATE_M:  # also refuses NaN
        raise ValueError(
            f"area_m is {list(area_m)}; give x_min, y_min, x_max, y_max in metres, at most "
            f"{MAX_COORDINATE_M:g} from the origin"
        )
    if area_m[0] >= area_m[2] or area_m[1] >= area_m[3]:
        raise ValueError(f"area_m is {list(area_m)}; x_min < x_max and y_min < y_max must hold")


@dataclass(frozen=True, slots=True)
class ImageSimilarityRequest:
    """Request for the regions of the map most similar to what a picture shows.

    Attributes:
        image: a PNG or JPEG of 16 to 4096 pixels on each side, at most 512 kB.
        query: the rest of the request; its text only names the image in the reply, and it has no
            negatives: features are more alike than a text and a feature, so that no text competes.
    """

    image: bytes
    query: SimilarityRequest

    def __post_init__(self) -> None:
        check_image(self.image)
        if self.query.negatives:
            raise ValueError("an image has no negatives: texts do not compete with it")


@dataclass(frozen=True, slots=True)
class AnsweredQuery:
    """A query that the mapper has answered, for recordings.

    Attributes:
        text: what was asked for.
        negatives: texts that competed with it.
        area_m: x_min, y_min, x_max, y_max of the part of the map that counted; empty: all of it.
        verdict: of the answer.
        best_score: of the best region, also of one below the encoder's floor.
        centre_m: x, y of the best region; empty if the answer has none.
    """

    text: str
    revision: int
    stamp_ns: int
    encoder_id: str
    verdict: Verdict
    best_score: float
    negatives: tuple[str, ...] = ()
    area_m: tuple[float, ...] = ()
    centre_m: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        _check_query(self)
        expect_share(self.best_score, "best_score")
        if len(self.centre_m) not in (0, 2) or not np.isfinite(self.centre_m).all():
            raise ValueError(f"centre_m is {self.centre_m}; give x, y in metres, or nothing")

    @property
    def texts(self) -> tuple[str, ...]:
        """All texts whose embeddings the answer depends on."""
        return (self.text, *self.negatives)


@dataclass(frozen=True, slots=True)
class SimilarityReply:
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
        nearest: known words near a text outside the encoder's vocabulary.
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
    """

    text: str
    revision: int
    stamp_ns: int
    encoder_id: str
    centres_m: F32
    extents_m: F32
    scores: F32
    variances: F32
    grid: GridSpec
    scores_grid: F32
    best_score: float = 0.0
    floor: float = 0.0
    nearest: tuple[str, ...] = ()
    outline_points_m: F32 = field(default_factory=lambda: np.zeros((0, 2), np.float32))
    outline_owner: I32 = field(default_factory=lambda: np.zeros(0, np.int32))
    last_seen_ns: I64 = field(default_factory=lambda: np.zeros(0, np.int64))
    best_views: F32 = field(default_factory=lambda: np.zeros((0, 3), np.float32))
    verdict: MapVerdict = NO_VERDICT
    heights_m: F32 = field(default_factory=lambda: np.zeros((0, 2), np.float32))
    calibrated: bool = field(default=False, metadata=ADDED)

    def __post_init__(self) -> None:
        count, corners = len(self.scores), len(self.outline_owner)
        expect(self.centres_m, "centres_m", np.float32, (count, 2))
        expect(self.extents_m, "extents_m", np.float32, (count, 4))
        expect(self.scores, "scores", np.float32, (count,))
        expect(self.variances, "variances", np.float32, (count,))
        expect(self.scores_grid, "scores_grid", np.float32, (None, None))
        expect(self.outline_points_m, "outline_points_m", np.float32, (corners, 2))
        expect(self.outline_owner, "outline_owner", np.int32, (corners,))
        expect(self.last_seen_ns, "last_seen_ns", np.int64, (count,))
        expect(self.best_views, "best_views", np.float32, (count, 3))
        expect(self.heights_m, "heights_m", np.float32, (count, 2))
        if corners and not 0 <= self.outline_owner.min() <= self.outline_owner.max() < count:
            raise ValueError(f"outline_owner names a region beyond the {count} there are")
        expect_share(self.best_score, "best_score")
        expect_share(self.floor, "floor")
