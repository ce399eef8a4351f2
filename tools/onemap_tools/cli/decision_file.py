"""Reads the decisions of a search, as the planner recorded them; describes them step by step."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

from rich.table import Table
from rich.text import Text

from onemap import ReplayStep, SearchReplay, SearchSnapshot
from onemap_tools.errors import CliError

SCHEMA = 1
MAX_FILE_BYTES = 4_000_000  # the planner writes at most 2 MB
Rendered = tuple[Text | Table, ...]


class DecisionStep(NamedTuple):
    """A step of a search: how it stood, and where the robot was (metres), if that was known."""

    search: SearchSnapshot
    robot_xy: tuple[float, float] | None


class DecisionFile(NamedTuple):
    """The steps of a search in their order; cut_off: the last line is not complete."""

    steps: tuple[DecisionStep, ...]
    cut_off: bool


def read_decisions(path: Path) -> DecisionFile:
    """The steps in a file; CliError with the line that cannot be read."""
    try:
        size = path.stat().st_size
        if size > MAX_FILE_BYTES:
            raise CliError(
                f"{path} has {size / 1e6:.1f} MB, and the planner records at most "
                f"{MAX_FILE_BYTES / 1e6:.0f} MB of decisions: it is another kind of file."
            )
        text = path.read_bytes().decode("utf-8")
    except OSError as problem:
        raise CliError(f"Cannot read {path}: {problem.strerror or problem}.") from problem
    except UnicodeDecodeError as problem:
        raise CliError(
            f"{path} is not text: give a file of the folder 'decisions' in planner.state_dir."
        ) from problem
    *lines, rest = text.split("\n")
    if not lines:
        raise CliError(f"{path} holds no decision: give a file in which a search was recorded.")
    steps = tuple(_step(path, number, line) for number, line in enumerate(lines, 1))
    return DecisionFile(steps, bool(rest))


def _step(path: Path, number: int, line: str) -> DecisionStep:
    try:
        document: dict[str, Any] = json.loads(line)
        if document["schema"] != SCHEMA:
            raise ValueError(f"schema {document['schema']}, this version reads {SCHEMA}")
        robot = document["robot_xy_m"]
        robot_xy = None if robot is None else (float(robot[0]), float(robot[1]))
        return DecisionStep(SearchSnapshot.of(document), robot_xy)
    except (ValueError, TypeError, KeyError, IndexError, AttributeError) as problem:
        raise CliError(
            f"{path}, line {number} is not a step of a search ({problem!r}): the file is damaged, "
            "or of another version."
        ) from problem


def describe_step(step: DecisionStep, number: int, count: int) -> Rendered:
    """What happened in a step, and the goals that were weighed if there were some."""
    search = step.search
    x_y = "" if step.robot_xy is None else f", robot at ({_place(step.robot_xy)})"
    head = (
        f"Step {number} of {count}, after {search.elapsed_s:.1f} s and "
        f"{search.path_length_m:.1f} m{x_y}"
    )
    lines = [Text(head, style="bold"), Text(f"{search.subject}: {search.state}: {search.reason}")]
    lines += [Text(f"{r.name or 'place'}: {r.outcome}: {r.reason}") for r in search.results[-1:]]
    if search.choice is None:
        return tuple(lines)
    table = Table("", "goal", "at", "score", "way", "utility", box=None)
    for option in search.choice.options:  # best first
        table.add_row(
            ">" if option.chosen else "",
            option.kind.replace("_", " "),
            f"({_place(option.xy_m)})",
            f"{option.score:.2f}",
            f"{option.travel_m:.1f} m",
            f"{option.utility:.2f}",
        )
    return (*lines, Text(f"Decision {search.choice.number}:"), table)


def decisions_document(decisions: DecisionFile) -> dict[str, Any]:
    """All steps as one JSON object."""
    last = decisions.steps[-1].search
    return {
        "id": last.id,
        "objects": list(last.objects),
        "state": last.state,
        "cut_off": decisions.cut_off,
        "steps": [dict(step.search.document) for step in decisions.steps],
    }


class PastSearch(NamedTuple):
    """A search as it is printed: its steps, the JSON object, what is missing in a sentence."""

    steps: tuple[Rendered, ...]
    document: dict[str, Any]
    missing: str


def recorded_search(path: Path) -> PastSearch:
    """What a file of the planner holds; CliError as ``read_decisions``."""
    decisions = read_decisions(path)
    count = len(decisions.steps)
    steps = (describe_step(step, n, count) for n, step in enumerate(decisions.steps, 1))
    cut = "The last line is not complete: the planner was ended while it wrote."
    return PastSearch(tuple(steps), decisions_document(decisions), cut if decisions.cut_off else "")


def replayed_search(replay: SearchReplay) -> PastSearch:
    """What a gateway tells of a search; the goals that did not win are in the file alone."""
    steps = tuple(_replayed(step, n, replay) for n, step in enumerate(replay.steps, 1))
    left = f"{replay.left_out} steps are left out." if replay.left_out else ""
    return PastSearch(steps, dict(replay.document), left)


def _replayed(step: ReplayStep, number: int, replay: SearchReplay) -> Rendered:
    x_y = "" if step.robot_m is None else f", robot at ({_place(step.robot_m)})"
    head = f"Step {number} of {len(replay.steps)}, after {step.elapsed_s:.1f} s{x_y}"
    subject = step.target or replay.search.subject
    lines = [Text(head, style="bold"), Text(f"{subject}: {step.state}: {step.reason}")]
    if step.goal_m is not None:
        kind = step.goal_kind.replace("_", " ")
        lines.append(Text(f"Goal: {kind} at ({_place(step.goal_m)})."))
    return tuple(lines)


def _place(xy: tuple[float, float]) -> str:
    return f"{xy[0]:.1f}, {xy[1]:.1f}"
