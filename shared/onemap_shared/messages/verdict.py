"""What a map says about an object that was asked for, beside the regions that look like it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


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
