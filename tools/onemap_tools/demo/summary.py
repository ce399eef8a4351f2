"""How well a search went, in numbers: success, path length against the shortest, map rate.

An object counts if the robot said "found" and stopped at a success place, which
``onemap_simulator.ground_truth`` defines; the search as a whole if all of its objects
count. SPL is that of Anderson et al. (2018) with the shortest path to such a place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import isfinite, nan
from typing import Any

from onemap_shared.messages import SearchState
from onemap_simulator.ground_truth import SUCCESS_TOLERANCE_M


@dataclass(frozen=True, slots=True)
class ObjectSummary:
    """How the search for one object ended, against the truth.

    Along the floor to the nearest success place, ``shortest_path_m`` from where the robot
    began and ``goal_distance_m`` from where it stopped; ``true_distance_m`` in a straight
    line from there to the nearest instance. Infinity if there is none, NaN if the robot's
    world does not tell the truth about itself. ``nearest`` names the thing that is nearest
    to ``position_m``, empty if that is unknown. ``judged``: whether the truth is known; where
    it is not, nobody says whether a claim is right.
    """

    name: str
    outcome: str
    reason: str
    position_m: tuple[float, ...]
    time_s: float
    path_length_m: float
    shortest_path_m: float
    true_distance_m: float
    goal_distance_m: float
    nearest: str = ""
    judged: bool = True

    @property
    def success(self) -> bool:
        """Whether it was found, truly."""
        return self.judged and self.claimed and self.goal_distance_m <= SUCCESS_TOLERANCE_M

    @property
    def counts(self) -> bool:
        """Whether it counts as found: truly, or by the robot's word where nobody can judge."""
        return self.claimed and (self.success or not self.judged)

    @property
    def claimed(self) -> bool:
        """Whether the robot said that it found it."""
        return self.outcome == SearchState.FOUND.value

    @property
    def claimed_wrongly(self) -> bool:
        """Whether the robot said that it found it and, as far as is known, did not."""
        return self.claimed and not self.counts

    @property
    def spl(self) -> float:
        """Success weighted by path length, in [0, 1]."""
        return path_efficiency(self.shortest_path_m, self.path_length_m) if self.success else 0.0

    def document(self) -> dict[str, Any]:
        """As JSON can carry it: what is not finite, and verdicts nobody can give, become null."""
        verdicts = {
            "spl": self.spl,
            "success": self.success,
            "claimed_wrongly": self.claimed_wrongly,
        }
        fields = asdict(self) | (verdicts if self.judged else dict.fromkeys(verdicts))
        return {name: finite(value) for name, value in fields.items()}


@dataclass(frozen=True, slots=True)
class DemoSummary:
    """A whole demo run. ``wanted``: every object that was asked for, in order."""

    wanted: tuple[str, ...]
    objects: tuple[ObjectSummary, ...]
    duration_s: float
    search_s: float
    map_rate_hz: float
    trouble: str = ""

    @property
    def found(self) -> int:
        """How many objects count as found."""
        return sum(item.counts for item in self.objects)

    @property
    def judged(self) -> int:
        """How many of the results could be judged."""
        return sum(item.judged for item in self.objects)

    @property
    def claimed_wrongly(self) -> int:
        """How many objects the robot said it found and did not."""
        return sum(item.claimed_wrongly for item in self.objects)

    @property
    def worked(self) -> bool:
        """Whether every object that was asked for counts as found."""
        return not self.trouble and bool(self.wanted) and self.found == len(self.wanted)

    @property
    def progress(self) -> float:
        """Fraction of the objects that were found before the first that was not (paper: PR)."""
        done = 0
        for item in self.objects:
            if not item.counts:
                break
            done += 1
        return done / len(self.wanted) if self.wanted else 0.0

    @property
    def spl(self) -> float:
        """SPL of the sequence: sum of shortest paths over the path driven, 0 unless all count.

        NaN if one of the results could not be judged.
        """
        if self.judged < len(self.objects):
            return nan
        if not self.worked:
            return 0.0
        shortest = sum(item.shortest_path_m for item in self.objects)
        return path_efficiency(shortest, sum(item.path_length_m for item in self.objects))

    def document(self) -> dict[str, Any]:
        """As JSON can carry it."""
        return {
            "worked": self.worked,
            "found": self.found,
            "judged": self.judged,
            "claimed_wrongly": self.claimed_wrongly,
            "objects": [item.document() for item in self.objects],
            "spl": finite(self.spl),
            "progress": self.progress,
            "duration_s": round(self.duration_s, 2),
            "search_s": round(self.search_s, 2),
            "map_rate_hz": finite(self.map_rate_hz),
            "trouble": self.trouble,
        }


def path_efficiency(shortest_m: float, driven_m: float) -> float:
    """Shortest over driven path, at most 1; 1 if neither had to be driven."""
    longest = max(shortest_m, driven_m)
    return shortest_m / longest if longest > 0 else 1.0


def rate_hz(counts: Sequence[int], times_s: Sequence[float]) -> float:
    """Events per second between the first and the last reading of a counter; NaN if too few."""
    if len(counts) < 2 or times_s[-1] <= times_s[0]:
        return float("nan")
    return (counts[-1] - counts[0]) / (times_s[-1] - times_s[0])


def finite(value: Any) -> Any:
    """Numbers rounded to a tenth of a millimetre; null for NaN and infinity; the rest as is."""
    if isinstance(value, float):
        return round(value, 4) if isfinite(value) else None
    if isinstance(value, tuple):
        return [finite(item) for item in value]
    return value
