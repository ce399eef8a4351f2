"""A benchmark's results: lines of text, and a folder with options, episodes, summary and page.

A run that was killed goes on where it stopped; a last line that was cut off is run again.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from onemap_shared.geometry import F64, U8
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import STYLES
from onemap_simulator.inspection import FloorMap
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.robot import RobotParams
from onemap_tools.bench.navigation.records import (
    DIFFERENCES,
    EPISODE,
    EpisodeRecord,
    Estimate,
    ObjectRecord,
)
from onemap_tools.cli.floor_plan import draw_floor_plan, draw_path

OPTIONS_FILE, EPISODES_FILE = "options.json", "episodes.jsonl"
RESULTS_FILE, PAGE_FILE = "results.json", "index.html"
# Settings of the search itself; those of simulator and perception are part of the task.
SEARCHING = ("config.planner.", "config.mapper.")
# What may differ beside them: the apartments that both searched are compared.
FREE = {"method", "episodes", "seed", "config.simulator.seed", "apartments", "order"}
COLOURS = ((200, 90, 0), (60, 150, 20), (0, 120, 240))  # BGR: blue, green, orange
STAIRWELL = (0, 0, 220)  # red
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
    """Metrics with their intervals, the reasons of failure, and comparisons."""
    errors = result.get("errors", "none")
    told = "" if errors == "none" else f", errors: {errors}"
    if wells := result.get("stairwells_per_episode"):
        told += f", {wells} stairwells"
    rows = {_title(name): Estimate(**values) for name, values in result["metrics"].items()}
    rows |= {f"failed: {name}": count for name, count in result["failures"].items()}
    rows["of these, by the time limit"] = result["timed_out"]
    shown = {key for key in COUNTS if result.get(key)}
    shown |= {"edges_crossed"} if "stairwells" in shown else set()
    rows |= {name: result[key] for key, name in COUNTS.items() if key in shown}
    compared = {
        f"{_title(name)}, {'less' if name in DIFFERENCES else 'over'} that of {method}": Estimate(
            **values
        )
        for method, other in result["compared_with"].items()
        for name, values in other["compared"].items()
    }
    return [
        f"{result['method']}, {result['features']} features{told}: "
        f"{result['episodes']} episodes, {result['objects']} objects, 95 % intervals",
        *(f"{name:38} {value}" for name, value in rows.items()),
        *(f"{name:52} {value}" for name, value in compared.items()),
    ]


def _title(metric: str) -> str:
    return TITLES.get(metric, f"SPL of object {metric.removeprefix('spl_')}")


class ResultsFolder:
    """Opens or creates the folder; ValueError if it holds results of other options."""

    def __init__(self, folder: Path, options: Mapping[str, Any]) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / OPTIONS_FILE
        wanted = json.loads(json.dumps(options))
        if file.exists():
            differing = _differing(_options(file), wanted)
            _refuse(folder, differing, "choose another folder for --out")
        else:
            file.write_text(json.dumps(wanted, indent=2) + "\n", encoding="utf-8")
        self._episodes = folder / EPISODES_FILE
        self.finished = _finished(self._episodes)
        self._episodes.write_text("".join(map(_line, self.finished)), encoding="utf-8")

    def add(self, record: EpisodeRecord) -> None:
        """Keep a finished episode."""
        with self._episodes.open("a", encoding="utf-8") as file:
            file.write(_line(record))

    def write_results(self, document: Mapping[str, Any], episodes: Sequence[EpisodeRecord]) -> None:
        """Write the summary, and the page with the episodes in their order."""
        text = json.dumps(document, indent=2) + "\n"
        (self.folder / RESULTS_FILE).write_text(text, encoding="utf-8")
        figures = ""
        for episode in episodes:
            figures += f"<p>{escape(episode_line(episode))}</p>"
            if (self.folder / picture_name(episode.index)).exists():
                figures += f'<img loading="lazy" src="{picture_name(episode.index)}">'
        table = escape("\n".join(table_lines(document)))
        page = (
            '<!doctype html><html lang="en"><meta charset="utf-8"><title>Episodes</title>'
            f"<pre>{table}</pre><p>Red: the start. The path to the first object is blue, to the "
            f"second green, to the third orange, then again from blue.</p>{figures}</html>\n"
        )
        (self.folder / PAGE_FILE).write_text(page, encoding="utf-8")


def read_beside(folder: Path, options: Mapping[str, Any]) -> tuple[str, list[EpisodeRecord]]:
    """Name and episodes of another run: its method, and its settings where they differ.

    ValueError if more differs than method, order, apartments and the settings of ``SEARCHING``:
    then the task was another one.
    """
    file = folder / OPTIONS_FILE
    if not file.exists():
        raise ValueError(f"{folder} holds no results of onemap bench navigation")
    before = _options(file)
    differing = _differing(before, options)
    settings = [name for name in differing if name.startswith(SEARCHING)]
    another = {k: each for k, each in differing.items() if k not in {*FREE, *settings}}
    advice = "only runs that differ in method, order, planner or mapper can be compared"
    _refuse(folder, another, advice)
    of = [f"{name.removeprefix('config.')} {differing[name][0]!r}" for name in settings]
    return ", ".join((str(before["method"]), *of)), _finished(folder / EPISODES_FILE)


def _refuse(folder: Path, differing: Mapping[str, tuple[Any, Any]], advice: str) -> None:
    if differing:
        named = [f"{name} {had!r} instead of {want!r}" for name, (had, want) in differing.items()]
        raise ValueError(f"{folder} holds results with {', '.join(named)}: {advice}")


def _differing(before: Mapping[str, Any], wanted: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Both values of each option in which the two differ, by its dotted name."""
    had, want = _flat(before), _flat(wanted)
    names = dict.fromkeys((*had, *want))
    both = {name: (had.get(name), want.get(name)) for name in names}
    return {name: (one, other) for name, (one, other) in both.items() if one != other}


def _flat(document: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """The document's values by dotted names."""
    values: dict[str, Any] = {}
    for name, value in document.items():
        inner = _flat(value, f"{prefix}{name}.") if isinstance(value, dict) else None
        values |= {f"{prefix}{name}": value} if inner is None else inner
    return values


def _options(file: Path) -> Mapping[str, Any]:
    try:
        options = json.loads(file.read_text(encoding="utf-8"))
    except ValueError:
        options = None
    if not isinstance(options, dict):
        raise ValueError(f"{file} is damaged: choose another folder for --out")
    return options


def _finished(file: Path) -> list[EpisodeRecord]:
    """The episodes of the file; a line that is not one, cut off by a kill, is left out."""
    records = {}
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
        try:
            record = EPISODE.validate_json(line)
        except ValueError:
            continue
        records[record.index] = record
    return list(records.values())


def _line(record: EpisodeRecord) -> str:
    return json.dumps(record.document(), allow_nan=False) + "\n"


def picture_name(index: int) -> str:
    """File name of an episode's picture."""
    return f"episode_{index:04d}.png"


def episode_picture(episode: EpisodeRecord, style: str, robot: RobotParams) -> U8:
    """A BGR image (rows, columns, 3): the floor plan, stairwells, and each object's path."""
    scene = generate_apartment(episode.seed, STYLES[style])
    collision = CollisionMap.of(scene, robot.height_m)
    reachable = collision.reachable_cells(*episode.start[:2], robot.radius_m)
    floor = FloorMap(collision.grid, collision.clearance <= 0, reachable)
    image = draw_floor_plan(scene, floor, episode.start)
    for x0, y0, x1, y1 in episode.stairwells:
        corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)])
        image = draw_path(image, floor.grid, corners, STAIRWELL)
    for index, path in enumerate(paths_of(episode)):
        image = draw_path(image, floor.grid, path, COLOURS[index % len(COLOURS)])
    return image


def paths_of(episode: EpisodeRecord) -> list[F64]:
    """The trajectory (N, 2) cut into the paths to each object, by the time that each took."""
    points = np.array(episode.trajectory, np.float64).reshape(-1, 2)
    times_s = np.cumsum([item.time_s for item in episode.objects])
    if len(points) == 0 or times_s[-1] <= 0:
        return []
    ends = np.rint(times_s / times_s[-1] * (len(points) - 1)).astype(int)
    starts = np.append(0, ends[:-1])
    return [points[a : b + 1] for a, b in zip(starts, ends, strict=True)]
