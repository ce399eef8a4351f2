"""Metrics of a search: success, SPL, wrong claims and map rate.

An object counts as found if the robot claims it and stops at a success position, which
``onemap_simulator.ground_truth`` defines; a search succeeds if all of its objects count. SPL is
that of Anderson et al. (2018) with the shortest path to such a position.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import inf, isfinite, nan
from typing import Any

from onemap_shared.messages import SearchState
from onemap_simulator.ground_truth import SUCCESS_TOLERANCE_M


@dataclass(frozen=True, slots=True)
class ObjectSummary:
    """The result for one object, compared with the ground truth.

    Path lengths along the floor to the nearest success position: ``shortest_path_m`` from the
    robot's start, ``goal_distance_m`` from where it stopped. ``true_distance_m``: straight line
    from where it stopped to the nearest instance. Infinity if there is no instance, NaN without
    ground truth. ``nearest``: category of the thing nearest to ``position_m``, empty if
    unknown. ``judged``: whether there is ground truth for this object.
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
        """Whether the claim is right by the ground truth."""
        return self.judged and self.claimed and self.goal_distance_m <= SUCCESS_TOLERANCE_M

    @property
    def counts_as_found(self) -> bool:
        """Whether it counts as found: by the ground truth, or by the claim where there is none."""
        return self.claimed and (self.success or not self.judged)

    @property
    def claimed(self) -> bool:
        """Whether the robot claims to have found it."""
        return self.outcome == SearchState.FOUND.value

    @property
    def claimed_wrongly(self) -> bool:
        """Whether the claim is wrong by the ground truth."""
        return self.claimed and not self.counts_as_found

    @property
    def spl(self) -> float:
        """Success weighted by path length, in [0, 1]."""
        return path_efficiency(self.shortest_path_m, self.path_length_m) if self.success else 0.0

    def document(self) -> dict[str, Any]:
        """As a JSON object; values that are not finite or not judged become null."""
        verdicts = {
            "spl": self.spl,
            "success": self.success,
            "claimed_wrongly": self.claimed_wrongly,
        }
        fields = asdict(self) | (verdicts if self.judged else dict.fromkeys(verdicts))
        return {name: json_value(value) for name, value in fields.items()}


@dataclass(frozen=True, slots=True)
class RobotSummary:
    """What one of several robots did: the results for its objects, what it drove and for how long.

    ``contacts``: as in ``DemoSummary``.
    """

    name: str
    objects: tuple[ObjectSummary, ...]
    path_length_m: float
    search_s: float
    contacts: int | None = None

    @property
    def found(self) -> tuple[str, ...]:
        """Names of its objects that count as found."""
        return tuple(item.name for item in self.objects if item.counts_as_found)

    def document(self) -> dict[str, Any]:
        """As a JSON object."""
        return {
            "name": self.name,
            "objects": [item.name for item in self.objects],
            "found": list(self.found),
            "path_length_m": round(self.path_length_m, 2),
            "search_s": round(self.search_s, 2),
            "contacts": self.contacts,
        }


@dataclass(frozen=True, slots=True)
class DemoSummary:
    """The result of a demo run.

    ``wanted``: all objects to search for, in order; ``objects``: the results in that order.
    ``failure``: why the run ended early, empty if it did not; "trouble" in the JSON document.
    ``contacts``: above 0.05 m/s, as the simulators counted them; None if one did not say.
    ``robots``: of several; ``closest_m``: between the middles of two of them, infinity without.
    """

    wanted: tuple[str, ...]
    objects: tuple[ObjectSummary, ...]
    duration_s: float
    search_s: float
    map_rate_hz: float
    failure: str = ""
    contacts: int | None = None
    robots: tuple[RobotSummary, ...] = ()
    closest_m: float = inf

    @property
    def not_sought(self) -> tuple[str, ...]:
        """The wanted objects without a result."""
        left = Counter(self.wanted) - Counter(item.name for item in self.objects)
        return tuple(left.elements())

    @property
    def found(self) -> int:
        """How many objects count as found."""
        return sum(item.counts_as_found for item in self.objects)

    @property
    def judged(self) -> int:
        """For how many of the results there is ground truth."""
        return sum(item.judged for item in self.objects)

    @property
    def claimed_wrongly(self) -> int:
        """How many claims are wrong."""
        return sum(item.claimed_wrongly for item in self.objects)

    @property
    def worked(self) -> bool:
        """Whether every wanted object counts as found."""
        return not self.failure and bool(self.wanted) and self.found == len(self.wanted)

    @property
    def progress(self) -> float:
        """Fraction of the objects that were found before the first failure (paper: PR)."""
        done = 0
        for name, item in zip(self.wanted, self.objects, strict=False):
            if item.name != name or not item.counts_as_found:
                break
            done += 1
        return done / len(self.wanted) if self.wanted else 0.0

    @property
    def spl(self) -> float:
        """SPL of the sequence: sum of shortest paths over the path driven, 0 unless all count.

        NaN if a result has no ground truth.
        """
        if self.judged < len(self.objects):
            return nan
        if not self.worked:
            return 0.0
        shortest = sum(item.shortest_path_m for item in self.objects)
        return path_efficiency(shortest, sum(item.path_length_m for item in self.objects))

    def document(self) -> dict[str, Any]:
        """As a JSON object."""
        return {
            "worked": self.worked,
            "found": self.found,
            "judged": self.judged,
            "claimed_wrongly": self.claimed_wrongly,
            "objects": [item.document() for item in self.objects],
            "spl": json_value(self.spl),
            "progress": self.progress,
            "duration_s": round(self.duration_s, 2),
            "search_s": round(self.search_s, 2),
            "map_rate_hz": json_value(self.map_rate_hz),
            "contacts": self.contacts,
            "trouble": self.failure,
            "robots": [robot.document() for robot in self.robots],
            "closest_m": json_value(self.closest_m),
        }


def in_order(wanted: Sequence[str], robots: Sequence[RobotSummary]) -> tuple[ObjectSummary, ...]:
    """The results of all robots in the order of the wanted objects."""
    objects = [item for robot in robots for item in robot.objects]
    return tuple(sorted(objects, key=lambda item: wanted.index(item.name)))


def total_contacts(robots: Sequence[RobotSummary]) -> int | None:
    """The contacts of all robots; None if those of one are unknown."""
    counts = [robot.contacts for robot in robots]
    known = [count for count in counts if count is not None]
    return sum(known) if len(known) == len(counts) else None


def path_efficiency(shortest_m: float, driven_m: float) -> float:
    """Shortest over driven path length, at most 1; 1 if both are zero."""
    longest = max(shortest_m, driven_m)
    return shortest_m / longest if longest > 0 else 1.0


def json_value(value: Any) -> Any:
    """Round floats to 4 digits, replace NaN and infinity by None, tuples by lists."""
    if isinstance(value, float):
        return round(value, 4) if isfinite(value) else None
    if isinstance(value, tuple):
        return [json_value(item) for item in value]
    return value
