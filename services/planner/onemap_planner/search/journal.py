"""Journal of the active search on disk, from which a restarted planner resumes it.

One JSON file, replaced atomically; without a file no search is active.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from onemap_planner.search.events import EventStamp
from onemap_planner.search.phases import (
    Budget,
    Destination,
    PausedTarget,
    Search,
    TargetStart,
)
from onemap_planner.search.state_machine import new_search
from onemap_shared.messages import (
    Coverage,
    FailureCode,
    ObjectResult,
    SearchKind,
    SearchOrder,
    SearchRequest,
    SearchState,
)

SCHEMA = 1
FILE_NAME = "search.json"


class JournalError(Exception):
    """A journal that cannot be used; the text says why."""


def save(folder: Path, search: Search, *, now_s: float, odometer_m: float) -> None:
    """Write the active search, or remove the file if the search is over."""
    path = folder / FILE_NAME
    if not search.active:
        path.unlink(missing_ok=True)
        return
    folder.mkdir(parents=True, exist_ok=True)
    document = {
        "schema": SCHEMA,
        "search_id": search.search_id,
        "objects": search.objects,
        "kind": search.kind.value,
        "place_m": search.destination.xy if search.destination else (),
        "order": search.order.value,
        "index": search.index,
        "done": search.done,
        "paused": [asdict(paused) for paused in search.paused],
        "max_distance_m": search.budget.max_distance_m,
        "max_time_s": search.budget.max_time_s,
        "results": [asdict(result) for result in search.results],
        "started_ns": search.started_ns,
        "elapsed_s": now_s - search.target_start.since_s,
        "path_length_m": odometer_m - search.target_start.odometer_m,
        "start_xy_m": search.target_start.xy,
    }
    draft = path.with_suffix(".draft")
    with draft.open("w", encoding="utf-8") as file:
        json.dump(document, file)
        file.flush()
        os.fsync(file.fileno())
    os.replace(draft, path)


def load(folder: Path, now_s: float) -> Search | None:
    """The search of the journal at its present object, or None if there is none.

    The time since it was written is not counted; the odometer begins at zero.
    """
    path = folder / FILE_NAME
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as problem:
        raise JournalError(f"cannot read {path}: {problem}") from problem
    try:
        return _search(document, now_s)
    except (KeyError, TypeError, ValueError) as problem:
        raise JournalError(f"{path} is not a search of schema {SCHEMA}: {problem!r}") from problem


def _search(document: Any, now_s: float) -> Search:
    if document["schema"] != SCHEMA:
        raise ValueError(f"schema {document['schema']}")
    # a journal of an earlier release has neither kind nor place, no order and no limits
    request = SearchRequest(
        tuple(document["objects"]),
        kind=SearchKind(document.get("kind", SearchKind.FIND.value)),
        place_m=tuple(float(value) for value in document.get("place_m", ())),
        max_distance_m=float(document.get("max_distance_m", 0.0)),
        max_time_s=float(document.get("max_time_s", 0.0)),
    )
    objects = request.objects
    results = tuple(_result(entry) for entry in document["results"])
    if len(results) >= max(len(objects), 1):
        raise ValueError("all its objects are done")
    target_start = TargetStart(
        since_s=now_s - float(document["elapsed_s"]),
        since_active_time_s=0.0,
        xy=_pair(document["start_xy_m"]),
        odometer_m=-float(document["path_length_m"]),
    )
    done = tuple(int(index) for index in document.get("done", range(len(results))))
    index = int(document.get("index", len(results)))
    known = {*done, index}
    if len(known) != len(results) + 1 or not known <= set(range(max(len(objects), 1))):
        raise ValueError(f"object {index} is sought and {done} are done")
    start = new_search(
        str(document["search_id"]),
        objects[index : index + 1],
        EventStamp(now_s, 0.0, None, 0.0),
        int(document["started_ns"]),
        Destination.of(request),
        order=SearchOrder(document.get("order", SearchOrder.GIVEN.value)),
    )
    paused = tuple(
        PausedTarget(**{**entry, "xy": _pair(entry["xy"])}) for entry in document.get("paused", ())
    )
    return replace(
        start,
        budget=Budget.of(request),
        objects=objects,
        index=index,
        results=results,
        target_start=target_start,
        done=done,
        paused=paused,
    )


def _pair(xy: Any) -> tuple[float, float] | None:
    return None if xy is None else (float(xy[0]), float(xy[1]))


def _result(entry: dict[str, Any]) -> ObjectResult:
    places = ("position_m", "start_xy_m", "end_xy_m")
    tuples = {name: _floats(entry[name]) for name in places}
    coverage = dict(entry.get("coverage", {}))
    coverage["best_match_m"] = _floats(coverage.get("best_match_m", ()))
    return ObjectResult(
        **{**entry, **tuples, "outcome": SearchState(entry["outcome"])}
        | {
            "reason_code": FailureCode(entry.get("reason_code", "")),
            "coverage": Coverage(**coverage),
            "box_px": _floats(entry.get("box_px", ())),
        }
    )


def _floats(values: Iterable[Any]) -> tuple[float, ...]:
    return tuple(float(value) for value in values)
