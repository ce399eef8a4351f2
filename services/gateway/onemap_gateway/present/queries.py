"""Answers of the map to "where is it?", as clients get them."""

from __future__ import annotations

from math import dist, floor, isfinite
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from onemap_gateway.present.formats import millimetres, rfc3339
from onemap_gateway.present.replies import Time
from onemap_gateway.present.views import age_s, finite
from onemap_shared.grid import GridSpec
from onemap_shared.messages import SimilarityReply, Verdict

Point = tuple[float, float]
MOVED_M = 0.1  # a cell of the default size
CHANGED_SCORE = 0.05
IMAGE_SUBJECT = "what the image shows"  # in sentences, where a text is quoted

FOUND_EXAMPLE: dict[str, Any] = {
    "text": "sofa",
    "verdict": "found",
    "sentence": "'sofa' is at (2.35, -1.10) m, with the score 0.91.",
    "regions": [
        {
            "rank": 1,
            "centre_m": [2.35, -1.1],
            "extent_m": [1.5, -1.6, 3.2, -0.6],
            "outline_m": [[1.5, -1.6], [3.2, -1.6], [3.2, -0.6], [1.5, -0.6]],
            "score": 0.91,
            "variance": 0.04,
            "height_m": [0.1, 0.9],
            "last_seen_at": "2026-01-01T00:00:12.400Z",
            "best_view": {"x_m": 0.6, "y_m": -0.4, "yaw_rad": -0.38},
        }
    ],
    "looked": {
        "share": 0.62,
        "looked_m2": 31.5,
        "not_looked_m2": 19.3,
        "frontiers": 4,
        "frontier_m": [5.15, 0.45],
    },
    "revision": 412,
    "age_s": 0.21,
    "encoder_id": "mini-1",
    "best_score": 0.91,
    "calibrated": True,
    "message": "",
    "did_you_mean": [],
    "grid": None,
}
ABSENT_EXAMPLE: dict[str, Any] = {
    **FOUND_EXAMPLE,
    "text": "skateboard",
    "verdict": "not_looked_yet",
    "sentence": "'skateboard' was not seen, but only 62 % of the reachable area was looked at; "
    "look behind the frontier at (5.15, 0.45) m next.",
    "regions": [],
    "best_score": 0.04,
    "message": "Nothing on the map looks like 'skateboard': the best score is 0.04, and answers "
    "begin at 0.22. Did you mean 'floor' or 'box'?",
    "did_you_mean": ["floor", "box"],
}


class BestView(BaseModel):
    """Where the camera was when it saw a region best, in the map frame."""

    x_m: float
    y_m: float
    yaw_rad: float = Field(description="0 faces along x, positive is to the left.")


class QueryRegion(BaseModel):
    """A region of the map that looks like the text."""

    rank: int = Field(description="1 is the best.")
    centre_m: Point = Field(description="x, y in the map frame, metres.")
    extent_m: tuple[float, float, float, float] = Field(
        description="x_min, y_min, x_max, y_max in metres."
    )
    outline_m: list[Point] = Field(
        description="Corners of the polygon around its cells, counter-clockwise, metres."
    )
    score: float = Field(description="Mean score of its best cells, 0 to 1.")
    variance: float | None = Field(description="Variance of the belief there; null: unbounded.")
    height_m: tuple[float, float] | None = Field(
        description="Between which heights above the floor the match lies, such as on a table or "
        "under it; null: not known, as in a map of an old file."
    )
    last_seen_at: Time | None = Field(
        description="When a camera last saw it, by the robot's clock; null: not known, as in a map "
        "of an old file."
    )
    best_view: BestView | None = Field(
        description="Where the camera was when it saw it best; null: as above."
    )


class LookedReport(BaseModel):
    """How much of the reachable area was looked at, or of the part of it that was asked for."""

    share: float = Field(description="0 to 1.")
    looked_m2: float
    not_looked_m2: float = Field(
        description="Seen from too far or too briefly, or hidden behind a frontier."
    )
    frontiers: int = Field(description="Borders of the known floor behind which nobody looked.")
    frontier_m: Point | None = Field(
        description="x, y of the one to look behind next; null if there is none."
    )


class ScoreGrid(BaseModel):
    """The score of every cell: ``scores[ix][iy]``, x to the right, y up, null: not observed."""

    cell_size_m: float
    origin_m: Point = Field(description="x, y of the lower left corner of [0][0].")
    shape: tuple[int, int]
    scores: list[list[float | None]]


class QueryReply(BaseModel):
    """Whether it is on the map, and ranked regions that look like it, best first.

    What scores below the encoder's floor is left out; ``message`` then says so.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [FOUND_EXAMPLE, ABSENT_EXAMPLE]})

    text: str = Field(description="As it was asked; `image` where an image was.")
    verdict: Verdict = Field(
        description="`found`, `not_here`: the reachable area was looked at without finding it, or "
        "`not_looked_yet`."
    )
    sentence: str = Field(description="The verdict in words.")
    regions: list[QueryRegion]
    looked: LookedReport
    revision: int = Field(description="Counts every change of the map.")
    age_s: float | None = Field(description="Age of the newest frame in the map; null if empty.")
    encoder_id: str
    best_score: float = Field(description="Of the best region, also if it was left out.")
    calibrated: bool = Field(
        description="Whether scores are probabilities; if not, as of an image or of an encoder "
        "without a calibration, only their order means anything."
    )
    message: str = Field(description="Why there are no regions; empty if there are.")
    did_you_mean: list[str] = Field(
        description="The nearest known words, if the encoder cannot place the text."
    )
    grid: ScoreGrid | None = None


class QueryListReply(BaseModel):
    """The answers to several texts, in their order."""

    answers: list[QueryReply]


def query_reply(reply: SimilarityReply, now_ns: int, *, subject: str = "") -> QueryReply:
    """The verdict, the regions in order of their score, and the reason if there are none.

    subject: of its sentences, in the place of the text.
    """
    sentence = verdict_sentence(reply, subject)
    regions = [_region(reply, index) for index in range(len(reply.scores))]
    judged = reply.verdict
    return QueryReply(
        text=reply.text,
        verdict=judged.verdict,
        sentence=sentence[0].upper() + sentence[1:],
        regions=regions,
        looked=LookedReport(
            share=round(judged.looked_share, 3),
            looked_m2=round(judged.looked_m2, 2),
            not_looked_m2=round(judged.not_looked_m2, 2),
            frontiers=judged.frontiers,
            frontier_m=millimetres(judged.frontier_m) or None,
        ),
        revision=reply.revision,
        age_s=age_s(reply.stamp_ns, now_ns),
        encoder_id=reply.encoder_id,
        best_score=reply.best_score,
        calibrated=reply.calibrated,
        message="" if regions else no_match_message(reply, subject),
        did_you_mean=list(reply.nearest),
        grid=_score_grid(reply.grid, reply.scores_grid) if reply.scores_grid.size else None,
    )


def differ(a: QueryReply, b: QueryReply) -> bool:
    """Whether two answers to a text differ by more than the map's noise.

    Another verdict, another number of regions, or one that moved or scores otherwise.
    """
    if (a.verdict, len(a.regions)) != (b.verdict, len(b.regions)):
        return True
    return any(
        dist(one.centre_m, other.centre_m) > MOVED_M or abs(one.score - other.score) > CHANGED_SCORE
        for one, other in zip(a.regions, b.regions, strict=True)
    )


def _region(reply: SimilarityReply, index: int) -> QueryRegion:
    x_m, y_m, yaw_rad = reply.best_views[index].tolist()
    low_m, high_m = reply.heights_m[index].tolist()
    last_seen_ns = int(reply.last_seen_ns[index])
    view = None
    if isfinite(x_m):
        view = BestView(x_m=round(x_m, 3), y_m=round(y_m, 3), yaw_rad=round(yaw_rad, 3))
    return QueryRegion(
        rank=index + 1,
        centre_m=millimetres(reply.centres_m[index]),
        extent_m=millimetres(reply.extents_m[index]),
        outline_m=[
            millimetres(corner) for corner in reply.outline_points_m[reply.outline_owner == index]
        ],
        score=float(reply.scores[index]),
        variance=finite(reply.variances[index]),
        height_m=(round(low_m, 3), round(high_m, 3)) if isfinite(low_m) else None,
        last_seen_at=rfc3339(last_seen_ns) if last_seen_ns else None,
        best_view=view,
    )


def verdict_sentence(reply: SimilarityReply, subject: str = "") -> str:
    """The verdict in words. subject: what stands in the place of the text."""
    subject = subject or repr(reply.text)
    judged, percent = reply.verdict, floor(reply.verdict.looked_share * 100)
    if judged.verdict is Verdict.FOUND and len(reply.centres_m):
        x_m, y_m = reply.centres_m[0]
        return f"{subject} is at ({x_m:.2f}, {y_m:.2f}) m, with the score {reply.best_score:.2f}."
    if judged.verdict is Verdict.NOT_HERE:
        return (
            f"{subject} is not here: {percent} % of the reachable area was looked at, and "
            f"the best score is {reply.best_score:.2f}."
        )
    sentence = f"{subject} was not seen, but only {percent} % of the reachable area was looked at"
    if judged.frontier_m:
        x_m, y_m = judged.frontier_m
        sentence += f"; look behind the frontier at ({x_m:.2f}, {y_m:.2f}) m next"
    return sentence + "."


def no_match_message(reply: SimilarityReply, subject: str = "") -> str:
    """Why the result of a query is empty, and known words near to it. subject: as above."""
    subject = subject or repr(reply.text)
    best = floor(reply.best_score * 100) / 100  # rounded down: it must not read like the floor
    sentence = f"Nothing on the map looks like {subject}"
    if reply.floor > 0:
        sentence += f": the best score is {best:.2f}, and answers begin at {reply.floor:.2f}"
    if reply.nearest:
        sentence += f". Did you mean {' or '.join(map(repr, reply.nearest))}?"
    return sentence if reply.nearest else sentence + "."


def _score_grid(grid: GridSpec, scores: np.ndarray) -> ScoreGrid:
    rounded = np.round(scores.astype(np.float64), 4).tolist()
    return ScoreGrid(
        cell_size_m=grid.cell_size_m,
        origin_m=millimetres(grid.bounds_m[:2]),
        shape=grid.shape,
        scores=[[finite(score) for score in column] for column in rounded],
    )
