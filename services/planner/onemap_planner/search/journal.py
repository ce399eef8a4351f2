"""Journal of the active search on disk, and of one that was interrupted until another begins.

One JSON file, replaced atomically. Whether the search goes on says ``resumption``.
"""
# Touches files: the active search.

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from datetime import datetime, timezone
from math import dist
from pathlib import Path
from typing import Any

from onemap_planner.search.phases import (
    Budget,
    Destination,
    EventStamp,
    Finished,
    PausedTarget,
    Search,
    TargetStart,
)
from onemap_planner.search.state_machine import new_search, status
from onemap_shared.messages import (
    Coverage,
    FailureCode,
    ObjectResult,
    SearchKind,
    SearchOrder,
    SearchRequest,
    SearchState,
    SearchStatus,
)
from onemap_shared.wire import decode, encode

MAX_AWAY_S = 60.0  # a restarted planner is back in 2 to 30 s; later nobody expects a robot to start
MAX_MOVED_M = 2.0  # it drives on and brakes after the last record, under 1.1 m at 0.7 m/s


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What a search rests on beside its planner. Empty, 0 or None: not known.

    namespace: of the robot's keys. boot_id: of the start of the planner's computer; boot_s: seconds
    since then, also those in suspend: clocks of the day may jump. robot: its process. map_id: of
    the map in the running mapper; another one after clear, load and restart. odometry: number of
    the robot's newest message, xy_m: where it was.
    """

    namespace: str = ""
    boot_id: str = ""
    boot_s: float = 0.0
    robot: str = ""
    map_id: str = ""
    odometry: int = -1
    xy_m: tuple[float, float] | None = None

    @property
    def known(self) -> bool:
        """Whether robot and map were heard."""
        return bool(self.robot and self.map_id and self.odometry >= 0 and self.xy_m)


def interruption(then: Surroundings, now: Surroundings) -> str:
    """Why a search that was active then has ended; empty if it may go on.

    What is not known yet of ``now`` speaks neither for nor against it: it must be ``now.known``
    before the robot moves. What was not known then ends the search.
    """
    away_s = now.boot_s - then.boot_s
    moved_m = dist(now.xy_m, then.xy_m) if now.xy_m and then.xy_m else 0.0
    table = (
        (not (then.known and then.boot_id), "it is not known what else was restarted"),
        (now.boot_id != then.boot_id, "the planner's computer was started anew"),
        (not 0.0 <= away_s <= MAX_AWAY_S, f"the planner was away for {away_s:.0f} s"),
        (now.namespace != then.namespace, f"its robot was that of the keys {then.namespace!r}"),
        (now.robot not in ("", then.robot), "the robot was started anew"),
        (now.map_id not in ("", then.map_id), "the map is another one"),
        (0 <= now.odometry < then.odometry, "the robot counts its poses anew"),
        (not moved_m <= MAX_MOVED_M, f"the robot is {moved_m:.1f} m from where it was"),
    )
    return next((why for ended, why in table if ended), "")


def interrupted_reason(search: Search, why: str, at_ns: int) -> str:
    """Why and when a search was interrupted, and what was found, in one sentence."""
    at = datetime.fromtimestamp(at_ns / 1e9, tz=timezone.utc)
    found = [each.name for each in search.results if each.outcome is SearchState.FOUND]
    what = f"; found before: {', '.join(found)}" if found else ""
    return f"interrupted at {at:%Y-%m-%d %H:%M:%S} UTC: {why}{what}"


SCHEMA = 1
FILE_NAME = "search.json"
SET_ASIDE = "search.json.unreadable"
MAX_FILE_BYTES = 1_000_000  # a search for 20 objects takes 20 kB
MAX_REASON_CHARS = 200
MAX_NS = 4_000_000_000 * 10**9  # since 1970: dates up to 2096 can be told
MAX_NUMBER = 1e12  # of seconds and metres: no sum of them becomes infinite
SEARCH_ID = re.compile(r"[A-Za-z0-9_-]{1,64}")  # it becomes the name of a file
# What reading a file of any content raises.
UNUSABLE = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)


class JournalError(Exception):
    """A journal that cannot be used; the text says why."""


@dataclass(frozen=True, slots=True)
class Recorded:
    """A search as it was, active, at ``written_ns`` since 1970.

    loaded_s: until then, in seconds of the monotonic clock, its times count as if it had gone on;
    around: what it rested on; interrupted: why it has ended, if that was recorded.
    """

    search: Search
    around: Surroundings
    written_ns: int
    loaded_s: float
    interrupted: str = ""


def save(
    folder: Path,
    search: Search,
    around: Surroundings,
    *,
    now_s: float,
    now_ns: int,
    odometer_m: float,
) -> None:
    """Write the active search, or remove the file if the search is over and not interrupted."""
    path = folder / FILE_NAME
    if not search.active:
        if search.phase != Finished(SearchState.INTERRUPTED):
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
        "around": asdict(around),
        "written_ns": now_ns,
    }
    _replace_file(path, document)


def mark_interrupted(folder: Path, why: str) -> None:
    """Record that the search of the file has ended: no later planner goes on with it."""
    path = folder / FILE_NAME
    document = json.loads(path.read_text(encoding="utf-8"))
    _replace_file(path, {**document, "interrupted": why})


def _replace_file(path: Path, document: dict[str, Any]) -> None:
    draft = path.with_suffix(".draft")
    with draft.open("w", encoding="utf-8") as file:
        json.dump(document, file)
        file.flush()
        os.fsync(file.fileno())
    os.replace(draft, path)


def load(folder: Path, now_s: float) -> Recorded | None:
    """The search of the journal at its present object, or None if there is none.

    The time since it was written is not counted; the odometer begins at zero. Raises
    ``JournalError`` for every file that the planner could not go on with.
    """
    path = folder / FILE_NAME
    try:
        size = path.stat().st_size
        if size > MAX_FILE_BYTES:
            raise JournalError(f"{path} has {size} bytes, more than {MAX_FILE_BYTES}")
        document = json.loads(
            path.read_text(encoding="utf-8"), parse_float=_finite, parse_constant=_finite
        )
        search = _search(document, now_s)
        recorded = _recorded(document, search, now_s)
        said = replace(search, reason=recorded.interrupted or search.reason)
        decode(SearchStatus, encode(status(said, odometer_m=0.0, now_ns=0)))  # can be published
    except FileNotFoundError:
        return None
    except OSError as problem:
        raise JournalError(f"cannot read {path}: {problem}") from problem
    except UNUSABLE as problem:
        reason = repr(problem)[:MAX_REASON_CHARS]
        raise JournalError(f"{path} is not a search of schema {SCHEMA}: {reason}") from problem
    return recorded


def set_aside(folder: Path) -> str:
    """Rename a journal that cannot be used; returns what became of it, for people."""
    path = folder / FILE_NAME
    try:
        path.replace(folder / SET_ASIDE)
    except OSError as problem:
        return f"{path} cannot be renamed either: {problem.strerror}"
    return f"{path} is now {SET_ASIDE}"


def _search(document: Any, now_s: float) -> Search:
    """The search of a journal, whose elapsed seconds end at ``now_s``.

    Raises one of ``UNUSABLE`` for a document that no planner wrote.
    """
    if document["schema"] != SCHEMA:
        raise ValueError(f"schema {document['schema']}")
    request = _request(document)
    objects = request.objects
    results = tuple(_result(entry) for entry in document["results"])
    index, done = _progress(document, len(results), max(len(objects), 1))
    search_id, started_ns = str(document["search_id"]), int(document["started_ns"])
    if not SEARCH_ID.fullmatch(search_id) or not 0 <= started_ns < MAX_NS:
        raise ValueError(f"search_id is {search_id[:80]!r}, started_ns is {started_ns}")
    start = new_search(
        search_id,
        objects[index : index + 1],
        EventStamp(now_s, 0.0, None, 0.0),
        started_ns,
        Destination.of(request),
        order=SearchOrder(document.get("order", SearchOrder.GIVEN.value)),
    )
    target_start = TargetStart(
        since_s=now_s - _number(document["elapsed_s"]),
        since_active_time_s=0.0,
        xy=_pair(document["start_xy_m"]),
        odometer_m=-_number(document["path_length_m"]),
    )
    return replace(
        start,
        budget=Budget.of(request),
        objects=objects,
        index=index,
        results=results,
        target_start=target_start,
        done=done,
        paused=tuple(_paused(entry, len(objects)) for entry in document.get("paused", ())),
    )


def _recorded(document: Any, search: Search, now_s: float) -> Recorded:
    """With the surroundings, which journals of earlier releases lack."""
    around = document.get("around", {})
    written_ns = int(document.get("written_ns", search.started_ns))
    if not 0 <= written_ns < MAX_NS:
        raise ValueError(f"written_ns is {written_ns}")
    texts = {
        name: str(around.get(name, "")) for name in ("namespace", "boot_id", "robot", "map_id")
    }
    return Recorded(
        search,
        Surroundings(
            **texts,
            boot_s=_number(around.get("boot_s", 0.0)),
            odometry=int(around.get("odometry", -1)),
            xy_m=_pair(around.get("xy_m")),
        ),
        written_ns,
        now_s,
        str(document.get("interrupted", ""))[:MAX_REASON_CHARS],
    )


def _request(document: Any) -> SearchRequest:
    """What was asked for. Journals of earlier releases lack kind, place and limits."""
    return SearchRequest(
        tuple(document["objects"]),
        kind=SearchKind(document.get("kind", SearchKind.FIND.value)),
        place_m=_floats(document.get("place_m", ())),
        max_distance_m=_number(document.get("max_distance_m", 0.0)),
        max_time_s=_number(document.get("max_time_s", 0.0)),
    )


def _progress(document: Any, results: int, objects: int) -> tuple[int, tuple[int, ...]]:
    """Which object is sought now, and which are done, by their indices.

    Journals of earlier releases have neither: there the objects were sought in their order.
    ValueError unless each result is of one object and another one is left.
    """
    if results >= objects:
        raise ValueError("all its objects are done")
    done = tuple(int(index) for index in document.get("done", range(results)))
    index = int(document.get("index", results))
    known = {*done, index}
    if len(known) != results + 1 or not known <= set(range(objects)):
        raise ValueError(f"object {index} is sought and {done} are done")
    return index, done


def _pair(xy: Any) -> tuple[float, float] | None:
    return None if xy is None else (_number(xy[0]), _number(xy[1]))


def _paused(entry: dict[str, Any], objects: int) -> PausedTarget:
    paused = PausedTarget(
        index=int(entry["index"]),
        spent_s=_number(entry["spent_s"]),
        spent_active_time_s=_number(entry["spent_active_time_s"]),
        driven_m=_number(entry["driven_m"]),
        xy=_pair(entry["xy"]),
    )
    if not 0 <= paused.index < objects:
        raise ValueError(f"object {paused.index} of {objects} is put aside")
    return paused


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
    return tuple(_number(value) for value in values)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{value!r} is no number")
    if abs(value) > MAX_NUMBER:
        raise ValueError(f"{value:g} is larger than {MAX_NUMBER:g}")
    return float(value)


def _finite(text: str) -> float:
    """A number of a JSON text: one that no search has is refused wherever it stands."""
    value = float(text)
    if not abs(value) <= MAX_NUMBER:  # also refuses NaN
        raise ValueError(f"{text[:20]} is larger than {MAX_NUMBER:g}")
    return value
