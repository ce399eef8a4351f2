"""The benchmark's result as lines of text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from onemap_tools.bench.navigation.choices import Errors
from onemap_tools.bench.navigation.comparison import DIFFERENCES
from onemap_tools.bench.navigation.metrics import Estimate
from onemap_tools.bench.navigation.records import EpisodeRecord, ObjectRecord

TITLES = {
    "sr": "SR per object",
    "spl": "SPL per object",
    "sequence_sr": "SR of the sequence",
    "sequence_spl": "SPL of the sequence",
    "pr": "PR (found before the first failure)",
    "ppl": "PPL",
    "spl_third_over_first": "SPL, third over first object",
    "wrong_claims": "wrong claims per object",
    "contacts": "contacts per episode",
    "path_m": "path per object, m",
    "time_s": "time per object, s",
}

COUNTS = {
    "people_touched": "contacts with people, all episodes",
    "stairwells": "stairwells, all episodes",
    "edges_crossed": "wheels over an edge, all episodes",
    "frames_lost": "frames lost, all episodes",
    "pose_jumps": "loop closures, all episodes",
    "pose_error_m": "largest error of the reported pose, m",
}


def episode_line(episode: EpisodeRecord) -> str:
    """One episode as a line of text."""
    objects = "; ".join(_object(item) for item in episode.objects)
    where = episode.scene or f"apartment {episode.seed}"
    return f"{where}, {episode.simulated_s:.0f} s: {objects}"


def _object(item: ObjectRecord) -> str:
    if item.success:
        return f"{item.name} found, SPL {item.spl:.2f} over {item.path_length_m:.1f} m"
    return f"{item.name}: {item.failure.value}{' (time)' if item.timed_out else ''}"


def table_lines(result: Mapping[str, Any]) -> list[str]:
    """Metrics with their intervals, and the reasons of failure."""
    lines = [
        f"{setting(result)}: {result['episodes']} episodes, "
        f"{result['objects']} objects, 95 % intervals"
    ]
    for name, values in result["metrics"].items():
        lines.append(f"{title(name):38} {Estimate(**values)}")
    lines += [f"{'failed: ' + name:38} {count}" for name, count in result["failures"].items()]
    lines.append(f"{'of these, by the time limit':38} {result['timed_out']}")
    told = {key for key in COUNTS if result.get(key)}
    told |= {"edges_crossed"} if "stairwells" in told else set()
    lines += [f"{name:38} {result[key]}" for key, name in COUNTS.items() if key in told]
    return lines + comparison_lines(result)


def setting(result: Mapping[str, Any]) -> str:
    """Method, features, and errors and stairwells, if there are any."""
    errors = result.get("errors", Errors.NONE.value)
    told = "" if errors == Errors.NONE.value else f", errors: {errors}"
    if result.get("stairwells_per_episode"):
        told += f", {result['stairwells_per_episode']} stairwells"
    return f"{result['method']}, {result['features']} features{told}"


def comparison_lines(result: Mapping[str, Any]) -> list[str]:
    """Ratios to, or differences from, the other methods."""
    return [
        f"{_compared(name, method):52} {Estimate(**values)}"
        for method, other in result["compared_with"].items()
        for name, values in other["compared"].items()
    ]


def _compared(name: str, method: str) -> str:
    return f"{title(name)}, {'less that of' if name in DIFFERENCES else 'over that of'} {method}"


def title(name: str) -> str:
    """The metric's name for people."""
    position = name.removeprefix("spl_")
    return TITLES.get(name, f"SPL of object {position}")
