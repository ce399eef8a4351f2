"""Answers of the map to "where is it?", as frozen dataclasses.

As in ``replies``, each has ``document``, the JSON object as it came, and members that an older
gateway leaves out are empty.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

Document = Mapping[str, Any]
Point = tuple[float, float]
Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Region:
    """A region of the map that looks like a text; ``rank`` 1 is the best.

    centre_m: x, y; extent_m: x_min, y_min, x_max, y_max; outline_m: corners of its polygon,
    counter-clockwise; score: 0 to 1; variance: of the belief there, None if unbounded;
    height_m: between which heights above the floor it lies, None if not known; last_seen_at:
    RFC 3339, empty if not known; best_view: x, y, yaw of the camera when it saw it best, metres
    and radians, None if not known.
    """

    rank: int
    centre_m: Point
    extent_m: Box
    outline_m: tuple[Point, ...]
    score: float
    variance: float | None
    height_m: Point | None
    last_seen_at: str
    best_view: tuple[float, float, float] | None
    document: Document = field(repr=False, compare=False)

    @classmethod
    def of(cls, document: Document) -> Region:
        """The region that ``document`` describes."""
        x_min, y_min, x_max, y_max = (float(value) for value in document["extent_m"])
        variance, view = document.get("variance"), document.get("best_view")
        height_m = document.get("height_m")
        return cls(
            rank=int(document["rank"]),
            centre_m=_point(document["centre_m"]),
            extent_m=(x_min, y_min, x_max, y_max),
            outline_m=tuple(map(_point, document.get("outline_m", ()))),
            score=float(document["score"]),
            variance=None if variance is None else float(variance),
            height_m=_point(height_m) if height_m else None,
            last_seen_at=str(document.get("last_seen_at") or ""),
            best_view=(float(view["x_m"]), float(view["y_m"]), float(view["yaw_rad"]))
            if view
            else None,
            document=document,
        )


@dataclass(frozen=True, slots=True)
class LookedArea:
    """How much of the reachable area was looked at, in square metres; ``share``: 0 to 1.

    frontiers: borders of the known floor behind which nobody looked; frontier_m: x, y of the one to
    look behind next, None if there is none.
    """

    share: float
    looked_m2: float
    not_looked_m2: float
    frontiers: int
    frontier_m: Point | None

    @classmethod
    def of(cls, document: Document) -> LookedArea:
        """The area that ``document`` describes."""
        frontier_m = document.get("frontier_m")
        return cls(
            share=float(document.get("share", 0.0)),
            looked_m2=float(document.get("looked_m2", 0.0)),
            not_looked_m2=float(document.get("not_looked_m2", 0.0)),
            frontiers=int(document.get("frontiers", 0)),
            frontier_m=_point(frontier_m) if frontier_m else None,
        )


@dataclass(frozen=True, slots=True)
class QueryResult:
    """Whether a text is on the map, and where it may be, best first.

    verdict: found, not_here or not_looked_yet; sentence: the same in words; looked: how much was
    looked at; best_score: of the best region, also if it was left out; calibrated: whether scores
    are probabilities, if not, only their order means anything; message: why there are no
    regions, empty if there are; did_you_mean: the nearest known words, if the encoder cannot place
    the text.
    """

    text: str
    verdict: str
    sentence: str
    regions: tuple[Region, ...]
    looked: LookedArea
    best_score: float
    calibrated: bool
    message: str
    did_you_mean: tuple[str, ...]
    document: Document = field(repr=False, compare=False)

    @property
    def found(self) -> bool:
        """Whether it is on the map; without a verdict, of an older gateway: if it has regions."""
        return self.verdict == "found" if self.verdict else bool(self.regions)

    @classmethod
    def of(cls, document: Document) -> QueryResult:
        """The result that ``document`` describes."""
        return cls(
            text=str(document["text"]),
            verdict=str(document.get("verdict", "")),
            sentence=str(document.get("sentence", "")),
            regions=tuple(map(Region.of, document["regions"])),
            looked=LookedArea.of(document.get("looked", {})),
            best_score=float(document.get("best_score", 0.0)),
            calibrated=bool(document.get("calibrated", False)),
            message=str(document.get("message", "")),
            did_you_mean=tuple(document.get("did_you_mean", ())),
            document=document,
        )

    @classmethod
    def all_of(cls, document: Document) -> tuple[QueryResult, ...]:
        """The results to several texts, in their order."""
        return tuple(map(cls.of, document["answers"]))


@dataclass(frozen=True, slots=True)
class QueryOptions:
    """What narrows a query.

    max_regions: best regions of each text; negatives: texts that compete with it; area_m: x_min,
    y_min, x_max, y_max of the part of the map that counts, None for all of it.
    """

    max_regions: int = 5
    negatives: tuple[str, ...] = ()
    area_m: Box | None = None

    def body(self, texts: str | Sequence[str]) -> dict[str, Any]:
        """The body of a request; what is not asked for is left out, for older gateways."""
        return self._completed({"text": texts} if isinstance(texts, str) else {"texts": [*texts]})

    def image_body(self, image: bytes) -> dict[str, Any]:
        """The body of a request for what a PNG or JPEG shows."""
        return self._completed({"image": b64encode(image).decode()})

    def _completed(self, asked: dict[str, Any]) -> dict[str, Any]:
        asked["max_regions"] = self.max_regions
        if self.negatives:
            asked["negatives"] = list(self.negatives)
        if self.area_m is not None:
            asked["area_m"] = list(self.area_m)
        return asked


NO_OPTIONS = QueryOptions()


def _point(values: Iterable[Any]) -> Point:
    x, y = (float(value) for value in values)
    return x, y
