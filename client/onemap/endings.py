"""How the search for an object ended: coverage of one not found, evidence of one found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class SearchCoverage:
    """What a search that found nothing has looked at, in square metres of free floor.

    best_match_m: x, y of where the map resembles the object most, None without features;
    best_score: similarity there, 0 to 1.
    """

    explored_m2: float
    free_m2: float
    unreachable_m2: float
    best_match_m: tuple[float, float] | None
    best_score: float

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> SearchCoverage:
        """The coverage that ``document`` describes."""
        best = document.get("best_match_m")
        return cls(
            explored_m2=float(document["explored_m2"]),
            free_m2=float(document["free_m2"]),
            unreachable_m2=float(document["unreachable_m2"]),
            best_match_m=(float(best[0]), float(best[1])) if best else None,
            best_score=float(document["best_score"]),
        )


@dataclass(frozen=True, slots=True)
class FindEvidence:
    """In what an object was seen; its picture is that of ``client.objects()``.

    frame_ns: capture time of the frame; box_px: x_min, y_min, x_max, y_max in it, None without;
    cells: of the map that support it.
    """

    frame_ns: int
    box_px: tuple[float, ...] | None
    cells: int

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> FindEvidence:
        """The evidence that ``document`` describes."""
        box = document.get("box_px")
        return cls(
            frame_ns=int(document["frame_ns"]),
            box_px=tuple(float(value) for value in box) if box else None,
            cells=int(document["cells"]),
        )
