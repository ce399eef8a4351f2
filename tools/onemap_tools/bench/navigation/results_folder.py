"""The folder of a benchmark's results: options, one line per finished episode, the report.

A run that was killed goes on where it stopped; a last line that was cut off is run again.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from onemap_tools.bench.navigation.page import metrics_by_method, page_html, spl_plot
from onemap_tools.bench.navigation.records import EpisodeRecord, episode_record

OPTIONS_FILE, EPISODES_FILE = "options.json", "episodes.jsonl"
# Settings of the search itself; those of simulator and perception are part of the task.
SEARCHING = ("config.planner.", "config.mapper.")
# What may differ beside them: the apartments that both searched are compared.
FREE = {"method", "episodes", "seed", "config.simulator.seed", "apartments", "order"}
RESULTS_FILE, PAGE_FILE, PLOT_FILE = "results.json", "index.html", "spl_by_position.svg"


class ResultsFolder:
    """Opens or creates the folder; ValueError if it holds results of other options."""

    def __init__(self, folder: Path, options: Mapping[str, Any]) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / OPTIONS_FILE
        wanted = json.loads(json.dumps(options))
        if file.exists():
            refuse_others(folder, _options(file), wanted, "choose another folder for --out")
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
        """Write the summary, its plot and the page with the episodes in their order."""
        for name, text in (
            (RESULTS_FILE, json.dumps(document, indent=2) + "\n"),
            (PLOT_FILE, spl_plot(metrics_by_method(document))),
            (PAGE_FILE, page_html(document, episodes)),
        ):
            (self.folder / name).write_text(text, encoding="utf-8")


def read_beside(folder: Path, options: Mapping[str, Any]) -> tuple[str, list[EpisodeRecord]]:
    """Name and episodes of another run: its method, and its settings where they differ.

    ValueError if more differs than method, order, apartments and the settings of ``SEARCHING``:
    then the task was another one.
    """
    file = folder / OPTIONS_FILE
    if not file.exists():
        raise ValueError(f"{folder} holds no results of onemap bench navigation")
    before = dict(_options(file))
    differing = _differing(before, options)
    settings = [name for name in differing if name.startswith(SEARCHING)]
    advice = "only runs that differ in method, order, planner or mapper can be compared"
    another = {k: each for k, each in differing.items() if k not in {*FREE, *settings}}
    _refuse(folder, another, advice)
    of = [f"{name.removeprefix('config.')} {differing[name][0]!r}" for name in settings]
    return ", ".join((str(before["method"]), *of)), _finished(folder / EPISODES_FILE)


def refuse_others(
    folder: Path, before: Mapping[str, Any], wanted: Mapping[str, Any], advice: str
) -> None:
    """Raise ValueError that names the options in which the two differ."""
    _refuse(folder, _differing(before, wanted), advice)


def _refuse(folder: Path, differing: Mapping[str, tuple[Any, Any]], advice: str) -> None:
    if differing:
        named = [f"{name} {had!r} instead of {want!r}" for name, (had, want) in differing.items()]
        raise ValueError(f"{folder} holds results with {', '.join(named)}: {advice}")


def _differing(before: Mapping[str, Any], wanted: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Both values of each option in which the two differ, by its dotted name."""
    had, want = flat(before), flat(wanted)
    names = dict.fromkeys((*had, *want))
    return {
        name: (had.get(name), want.get(name)) for name in names if had.get(name) != want.get(name)
    }


def flat(document: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """The document's values by dotted names."""
    values: dict[str, Any] = {}
    for name, value in document.items():
        inner = flat(value, f"{prefix}{name}.") if isinstance(value, dict) else None
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
    if not file.exists():
        return []
    records = {}
    for line in file.read_text(encoding="utf-8").splitlines():
        try:
            record = episode_record(json.loads(line))
        except (ValueError, KeyError, TypeError):
            continue
        records[record.index] = record
    return list(records.values())


def _line(record: EpisodeRecord) -> str:
    return json.dumps(record.document(), allow_nan=False) + "\n"
