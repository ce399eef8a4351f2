"""The results of a demo: judged by the ground truth, as JSON, and printed.

An object counts as found if the robot claims it and stops at a success position, which
``onemap_simulator.ground_truth`` defines; a search succeeds if all of its objects count. SPL is
that of Anderson et al. (2018) with the shortest path to such a position.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict, dataclass
from math import isfinite, nan
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from onemap_perception.text.vocabulary import Vocabulary
from onemap_shared.messages import SearchState, Truth
from onemap_shared.names import normalised
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


def names_of_classes(vocabulary: Vocabulary) -> list[tuple[str, ...]]:
    """All names of each class that the encoder ``mini`` was trained on."""
    return [(c.name, *c.aliases, *c.held_out, *c.query_aliases) for c in vocabulary.classes]


def scene_category(word: str, categories: Collection[str], vocabulary: Vocabulary) -> str:
    """The scene's category for an object that a user calls ``word``.

    The word itself if the scene has that category, else a category that is a synonym in the
    vocabulary ("couch" where the scene has "sofa"), else the word.
    """
    wanted = normalised(word)
    if wanted in categories:
        return wanted
    synonyms = next((names for names in names_of_classes(vocabulary) if wanted in names), ())
    return next((name for name in synonyms if name in categories), wanted)


@dataclass(frozen=True, slots=True)
class RobotSummary:
    """What one robot did: the results for its objects, what it drove and for how long.

    contacts: above 0.05 m/s, as its simulator counted them; None if it did not say.
    """

    name: str
    objects: tuple[ObjectSummary, ...]
    path_length_m: float
    search_s: float
    contacts: int | None = None

    @property
    def found(self) -> tuple[str, ...]:
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

    ``wanted``: all objects to search for, in order. ``failure``: why the run ended early, empty
    if it did not; "trouble" in the JSON document. ``duration_s`` and ``first_metre_s``, NaN if
    none was driven, count from the command.
    """

    wanted: tuple[str, ...]
    robots: tuple[RobotSummary, ...]
    duration_s: float
    search_s: float
    map_rate_hz: float
    failure: str = ""
    first_metre_s: float = nan

    @property
    def objects(self) -> tuple[ObjectSummary, ...]:
        """The results of all robots in the order of the wanted objects."""
        results = [item for robot in self.robots for item in robot.objects]
        return tuple(sorted(results, key=lambda item: self.wanted.index(item.name)))

    @property
    def several(self) -> tuple[RobotSummary, ...]:
        """The robots if there is more than one."""
        return self.robots if len(self.robots) > 1 else ()

    @property
    def not_sought(self) -> tuple[str, ...]:
        left = Counter(self.wanted) - Counter(item.name for item in self.objects)
        return tuple(left.elements())

    @property
    def found(self) -> int:
        """How many objects count as found."""
        return sum(item.counts_as_found for item in self.objects)

    @property
    def judged(self) -> int:
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
    def object_spl(self) -> float:
        """Mean SPL of the objects that were judged and not there at the start; NaN without any."""
        known = [item.spl for item in self.objects if item.judged and not item.there_at_start]
        return sum(known) / len(known) if known else nan

    def document(self) -> dict[str, Any]:
        """As a JSON object."""
        contacts = [robot.contacts for robot in self.robots if robot.contacts is not None]
        return {
            "worked": self.worked,
            "found": self.found,
            "judged": self.judged,
            "claimed_wrongly": self.claimed_wrongly,
            "objects": [
                item.document() | ({"spl": None} if item.there_at_start else {})
                for item in self.objects
            ],
            "object_spl": json_value(self.object_spl),
            "duration_s": round(self.duration_s, 2),
            "search_s": round(self.search_s, 2),
            "first_metre_s": json_value(self.first_metre_s),
            "map_rate_hz": json_value(self.map_rate_hz),
            "contacts": sum(contacts) if len(contacts) == len(self.robots) else None,
            "trouble": self.failure,
            "robots": [robot.document() for robot in self.several],
        }


def path_efficiency(shortest_m: float, driven_m: float) -> float:
    """Shortest over driven path length, at most 1; 1 if both are zero."""
    longest = max(shortest_m, driven_m)
    return shortest_m / longest if longest > 0 else 1.0


def json_value(value: Any) -> Any:
    """Round floats to 4 digits, replace NaN and infinity by None, tuples by lists."""
    if isinstance(value, float):
        return round(value, 4) if isfinite(value) else None
    return [json_value(item) for item in value] if isinstance(value, tuple) else value


LEGEND = (
    "shortest: the way from where it began to where the object counts as found\n"
    "off by: straight from where the robot stopped to the nearest one\n"
    "SPL -: it was there at the start"
)


def describe(summary: DemoSummary, picture: str | None, console: Console) -> None:
    """Print one row per object, the reasons of failures, totals and the picture's path."""
    titles = ("object", "outcome", "at", "time", "path", "shortest", "SPL", "off by")
    table = _table("outcome", titles)
    for item in summary.objects:
        table.add_row(*_row(item))
    for name in summary.not_sought:
        table.add_row(name, Text("not sought", style="dim"))
    console.print(table)
    console.print(Text(LEGEND, style="dim"))
    if summary.several:
        table = _table("found", ("robot", "found", "path", "time", "contacts"))
        for robot in summary.several:
            found = Text(", ".join(robot.found) or "nothing")
            contacts = "-" if robot.contacts is None else str(robot.contacts)
            path, time = metres(robot.path_length_m), f"{robot.search_s:.0f} s"
            table.add_row(robot.name, found, path, time, contacts)
        console.print(table)
    for item in summary.objects:
        if not (item.counts_as_found and item.judged):
            told = item.nearest and (item.claimed_wrongly or not item.judged)
            near = f" (nearest to the claimed place: {item.nearest})" if told else ""
            console.print(f"{item.name}: {item.reason}{near}")
    if summary.failure:
        console.print(Text(summary.failure, style="red"))
    driven = isfinite(summary.first_metre_s)
    first = f", first metre after {summary.first_metre_s:.0f} s" if driven else ""
    console.print(
        f"{summary.found} of {len(summary.wanted)} found in {summary.search_s:.0f} s "
        f"({summary.duration_s:.0f} s with starting up{first}), {_verdict(summary)}, "
        f"{summary.map_rate_hz:.1f} map updates/s"
    )
    if picture:
        console.print(f"Map, path and finds: {picture}", soft_wrap=True)


def _table(wrapped: str, titles: Sequence[str]) -> Table:
    """A table whose columns, but ``wrapped``, stay in one line."""
    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for title in titles:
        table.add_column(title, no_wrap=title != wrapped)
    return table


def _verdict(summary: DemoSummary) -> str:
    """Wrong claims and SPL, or for how many objects there is ground truth."""
    wrong = f"{summary.claimed_wrongly} claimed wrongly"
    if summary.judged == len(summary.objects):
        return f"{wrong}, SPL {number(summary.object_spl)} per object"
    known = f"ground truth for {summary.judged} of {len(summary.objects)}"
    return f"{known}, {wrong}" if summary.judged else "no ground truth"


def _row(item: ObjectSummary) -> tuple[str | Text, ...]:
    outcome = item.outcome.replace("_", " ")
    style = "green" if item.success else "red"
    if item.claimed_wrongly:
        outcome = "wrong one"
    elif item.claimed and not item.judged:
        outcome, style = "found (no ground truth)", "yellow"
    place = ", ".join(f"{value:.1f}" for value in item.position_m[:2])
    return (
        item.name,
        Text(outcome, style=style),
        f"({place})" if place else "-",
        f"{item.time_s:.0f} s",
        metres(item.path_length_m),
        metres(item.shortest_path_m),
        number(item.spl) if item.judged and not item.there_at_start else "-",
        metres(item.true_distance_m),
    )


def number(value: float) -> str:
    """A ratio with two digits; a dash if it is not finite."""
    return f"{value:.2f}" if isfinite(value) else "-"


def metres(value: float) -> str:
    """A length in metres; a dash if it is not finite."""
    return f"{value:.1f} m" if isfinite(value) else "-"
