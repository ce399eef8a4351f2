"""Journal of the decisions of each search on disk: written as it goes, read for its replay.

One file of JSON lines per search. A line has the members of ``GET /v1/searches/{id}``, so that it
is read as a reply of the gateway is; it is written at once and as a whole.
"""
# Touches files: the decisions of searches.

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from datetime import datetime, timezone
from math import ceil, dist
from pathlib import Path
from typing import IO, Any

import numpy as np
from pydantic import TypeAdapter

from onemap_planner.sentences import PLANNER_ENDED, interrupted
from onemap_shared.atomic_file import appending, remove
from onemap_shared.geometry import F32
from onemap_shared.messages import (
    ObjectResult,
    SearchRecord,
    SearchState,
    SearchStatus,
    SearchStep,
)
from onemap_shared.wire import MAX_HEADER_BYTES, encode

SCHEMA = 1
FOLDER = "decisions"
MAX_FILES = 50  # the newest are kept, as many as searches are remembered
MAX_FILE_BYTES = 2_000_000  # about 1500 decisions; then only the end is recorded
TAIL_BYTES = 128_000  # hold the last line of a file
PLACE_STEP_M = 0.25  # between two recorded places: no corner of a way is cut by more than 0.1 m
MAX_PLACES = 2000  # of one line and of one replay: 500 m in steps of ``PLACE_STEP_M``
MAX_STEPS = 300  # of one replay: under 100 kB
# What reading a file of any content raises.
UNUSABLE = (ArithmeticError, LookupError, RecursionError, TypeError, ValueError)
STATUS = TypeAdapter(SearchStatus)

Place = tuple[float, float, float]  # seconds since the search began, x, y in metres


class Trail:
    """Where the robot was since the newest recorded step."""

    def __init__(self) -> None:
        self._places: list[Place] = []

    def add(self, elapsed_s: float, xy: tuple[float, float]) -> None:
        """Keep a place, unless it is near the one before."""
        if self._places and dist(self._places[-1][1:], xy) < PLACE_STEP_M:
            return
        self._places.append((round(elapsed_s, 2), round(xy[0], 3), round(xy[1], 3)))
        if len(self._places) > MAX_PLACES:
            del self._places[1::2]

    def take(self) -> tuple[Place, ...]:
        """The places, for the step that is recorded now; the next begin anew."""
        places, self._places = tuple(self._places), []
        return places


def record(
    folder: Path,
    status: SearchStatus,
    robot_xy: tuple[float, float] | None,
    places: Sequence[Place] = (),
    *,
    always: bool = False,
) -> None:
    """Append a step of a search to its file, and wait until it is on disk; raises OSError.

    robot_xy: metres in the map frame, None without odometry; places: since the step before;
    always: also where the file is full, as the end of the search is.
    """
    path = folder / FOLDER / file_name(status)
    if not path.exists():
        _remove_oldest(path.parent, MAX_FILES - 1)
    with appending(path) as file:
        file.truncate(_complete_bytes(file))
        full = file.seek(0, os.SEEK_END) > MAX_FILE_BYTES
        if full and status.active and not always:
            return
        document = step_document(status, robot_xy, places)
        file.write(json.dumps(document, allow_nan=False).encode() + b"\n")


def file_name(status: SearchStatus) -> str:
    """The name of the file of a search; names sort by the time when the search began."""
    began = datetime.fromtimestamp(status.started_ns / 1e9, tz=timezone.utc)
    return f"{began:%Y%m%dT%H%M%SZ}-{status.search_id}.jsonl"


def step_document(
    status: SearchStatus, robot_xy: tuple[float, float] | None, places: Sequence[Place] = ()
) -> Mapping[str, Any]:
    """The line of a step, as a dict."""
    values = asdict(status)
    choice = values.pop("choice")
    del values["passed"]  # of now; the reasons of the steps tell the rest
    return {
        "schema": SCHEMA,
        "id": values.pop("search_id"),
        "robot_xy_m": robot_xy,
        "path_m": places,
        "target": status.target,
        **values,
        "choice": choice if choice["options"] else None,
    }


def past(folder: Path) -> list[SearchStatus]:
    """How each recorded search stood last, newest first; files that cannot be read are left out.

    Without where it set out: the frame of that may have been another driver's.
    """
    statuses = []
    for path in sorted((folder / FOLDER).glob("*.jsonl"), reverse=True):
        try:
            with path.open("rb") as file:
                file.seek(max(file.seek(0, os.SEEK_END) - TAIL_BYTES, 0))
                status = _status(_documents(file.read()[-TAIL_BYTES:], last=True)[-1])
                statuses.append(replace(status, start_m=()))
        except (OSError, *UNUSABLE):
            continue
    return statuses


def read(folder: Path, search_id: str) -> SearchRecord | None:
    """What was recorded of a search, thinned until it is small; None if nothing can be read.

    Of more than ``MAX_PLACES`` places every second, third, ... is kept; of more than ``MAX_STEPS``
    steps all that changed the state or the object, and evenly spaced ones of the others.
    """
    paths = (folder / FOLDER).glob("*.jsonl")
    path = next((each for each in paths if each.stem.partition("-")[2] == search_id), None)
    if path is None:
        return None
    try:
        documents = _documents(path.read_bytes())
        status, steps = _status(documents[-1]), [_step(each) for each in documents]
        return _fitting(status, steps, _places(documents))
    except (OSError, *UNUSABLE):
        return None


def _places(documents: Sequence[Mapping[str, Any]]) -> F32:
    """(N, 3) seconds, x, y: the trails and where the robot was at each step."""
    places: list[Sequence[float]] = []
    for document in documents:
        places += document.get("path_m", ())
        if document["robot_xy_m"]:
            places.append((document["elapsed_s"], *document["robot_xy_m"]))
    return np.array(places, np.float32).reshape(-1, 3)


def _fitting(status: SearchStatus, steps: Sequence[SearchStep], places: F32) -> SearchRecord:
    """The record with as many steps as one message holds."""
    kept_places = places[_every(len(places), MAX_PLACES)]
    limit = MAX_STEPS
    while True:
        kept = _thinned(steps, limit)
        known = SearchRecord(status, kept, len(steps) - len(kept), kept_places)
        if limit == 1 or len(encode(known).header) <= MAX_HEADER_BYTES:
            return known
        limit //= 2


def _thinned(steps: Sequence[SearchStep], limit: int) -> tuple[SearchStep, ...]:
    """About ``limit`` steps, the last among them; see ``read``."""
    if len(steps) <= limit:
        return tuple(steps)
    last = len(steps) - 1
    turns = [i for i in range(last) if i == 0 or _turns(steps[i - 1], steps[i])]
    others = sorted({*range(last)} - {*turns})
    some = others[_every(len(others), max(limit - len(turns), 1))]
    kept = {*turns[_every(len(turns), limit)], *some, last}
    return tuple(steps[i] for i in sorted(kept))


def _turns(before: SearchStep, after: SearchStep) -> bool:
    return (before.state, before.target) != (after.state, after.target)


def _every(length: int, limit: int) -> slice:
    """Evenly spaced items of a sequence of this length, at most ``limit``."""
    return slice(None, None, max(ceil(length / limit), 1))


def _documents(content: bytes, *, last: bool = False) -> list[dict[str, Any]]:
    """The complete lines of a file, or the last of them; one that is cut off is left out."""
    lines = content.split(b"\n")[:-1]
    documents = [json.loads(line) for line in (lines[-1:] if last else lines)]
    if any(each["schema"] != SCHEMA for each in documents):
        raise ValueError(f"a schema is not {SCHEMA}")
    return documents


def _status(document: Mapping[str, Any]) -> SearchStatus:
    """How the search stood in a line; the planner of one that ran then has ended since."""
    names = {field.name for field in fields(SearchStatus)} - {"choice"}
    values = {name: document[name] for name in names & document.keys()}
    status = STATUS.validate_python({**values, "search_id": document["id"]})
    if not status.active:
        return status
    reason = interrupted(PLANNER_ENDED, status.updated_ns, status.results)
    if status.state is SearchState.RETURNING:  # all objects are done
        return replace(status, state=SearchState.INTERRUPTED, reason=reason)
    spent_s = status.elapsed_s - sum(each.duration_s for each in status.results)
    driven_m = status.path_length_m - sum(each.path_length_m for each in status.results)
    at = tuple(document["robot_xy_m"] or ())
    result = ObjectResult(
        name=status.target,
        outcome=SearchState.INTERRUPTED,
        reason=reason,
        position_m=(),
        score=0.0,
        duration_s=max(spent_s, 0.0),
        path_length_m=max(driven_m, 0.0),
        start_xy_m=(),
        end_xy_m=at,
        index=status.index,
    )
    results = (*status.results, result)
    return replace(status, state=SearchState.INTERRUPTED, reason=reason, results=results)


def _step(document: Mapping[str, Any]) -> SearchStep:
    choice = document["choice"] or {"options": ()}
    goal = next((each for each in choice["options"] if each["chosen"]), None)
    return SearchStep(
        float(document["elapsed_s"]),
        SearchState(document["state"]),
        str(document["target"]),
        str(document["reason"]),
        tuple(map(float, document["robot_xy_m"] or ())),
        goal_kind=str(goal["kind"]) if goal else "",
        goal_m=tuple(map(float, goal["xy_m"])) if goal else (),
    )


def _complete_bytes(file: IO[bytes]) -> int:
    """The length of a file without a last line that was cut off, as by a loss of power."""
    size = file.seek(0, os.SEEK_END)
    file.seek(max(size - 1, 0))
    if file.read(1) in (b"", b"\n"):
        return size
    file.seek(0)
    return file.read().rfind(b"\n") + 1


def _remove_oldest(folder: Path, keep: int) -> None:
    names = sorted(folder.glob("*.jsonl"))
    for path in names[: max(len(names) - keep, 0)]:
        remove(path)
