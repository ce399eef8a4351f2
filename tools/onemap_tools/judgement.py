"""What a robot said of an object, judged by the simulator's ground truth.

An object counts as found if the robot claims it and stops at a success position, which
``onemap_simulator.ground_truth`` defines; a search succeeds if all of its objects count. SPL is
that of Anderson et al. (2018) with the shortest path to such a position.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from math import isfinite, nan
from typing import Any

from onemap_shared.messages import SearchState, Truth
from onemap_shared.sentence import is_description
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
    def claimed(self) -> bool:
        return self.outcome == SearchState.FOUND.value

    @property
    def success(self) -> bool:
        """Whether the claim is right by the ground truth."""
        return self.judged and self.claimed and self.goal_distance_m <= SUCCESS_TOLERANCE_M

    @property
    def counts_as_found(self) -> bool:
        """Whether it counts as found: by the ground truth, or by the claim where there is none."""
        return self.claimed and (self.success or not self.judged)

    @property
    def claimed_wrongly(self) -> bool:
        return self.claimed and not self.counts_as_found

    @property
    def there_at_start(self) -> bool:
        """Whether it was found and there was no way to it that could be compared: SPL is 0."""
        return self.success and self.shortest_path_m == 0

    @property
    def spl(self) -> float:
        """Success weighted by path length, in [0, 1]."""
        return path_efficiency(self.shortest_path_m, self.path_length_m) if self.success else 0.0

    def document(self) -> dict[str, Any]:
        """As a JSON object; values that are not finite or not judged become null."""
        verdicts = {
            name: getattr(self, name) if self.judged else None
            for name in ("spl", "success", "claimed_wrongly")
        }
        return {name: json_value(value) for name, value in (asdict(self) | verdicts).items()}


# Asks for the ground truth of a category at a position in metres; None without a reply.
TruthQuery = Callable[[str, tuple[float, ...]], Truth | None]


def evaluate_result(result: dict[str, Any], name: str, query: TruthQuery) -> ObjectSummary:
    """Compare the gateway's result for one object with the ground truth of category ``name``.

    It is not judged without a reply, if the scene has unnamed objects and none of that category,
    or if the name is a description: a scene does not say what something is for.
    """

    def truth_at(place: list[float] | None) -> Truth | None:
        return query(name, tuple(place)) if place else None

    start, end = truth_at(result["start_xy_m"]), truth_at(result["end_xy_m"])
    claimed = truth_at(result["position_m"])
    return ObjectSummary(
        name=result["name"],
        outcome=result["outcome"],
        reason=result["reason"],
        position_m=tuple(result["position_m"] or ()),
        time_s=result["duration_s"],
        path_length_m=result["path_length_m"],
        shortest_path_m=start.shortest_path_m if start else nan,
        true_distance_m=end.distance_m if end else nan,
        goal_distance_m=end.shortest_path_m if end else nan,
        nearest=claimed.nearest if claimed else "",
        judged=end is not None
        and (end.names_complete or end.instances > 0)
        and not is_description(name),
    )


def path_efficiency(shortest_m: float, driven_m: float) -> float:
    """Shortest over driven path length, at most 1; 1 if both are zero."""
    longest = max(shortest_m, driven_m)
    return shortest_m / longest if longest > 0 else 1.0


def json_value(value: Any) -> Any:
    """Round floats to 4 digits, replace NaN and infinity by None, tuples by lists."""
    if isinstance(value, float):
        return round(value, 4) if isfinite(value) else None
    return [json_value(item) for item in value] if isinstance(value, tuple) else value
