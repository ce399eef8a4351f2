"""Journal of the active search on disk, and of one that was interrupted until another begins.

One JSON file, replaced atomically. Whether the search goes on says ``resumption``.
"""
# Touches files: the active search.

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from math import dist
from pathlib import Path
from typing import Annotated, Literal

from pydantic import ConfigDict, Field, TypeAdapter

from onemap_planner.search.state_machine import (
    Budget,
    Destination,
    EventStamp,
    Finished,
    PausedTarget,
    Search,
    TargetStart,
    new_search,
    status,
)
from onemap_shared.atomic_file import replacing
from onemap_shared.messages import (
    Details,
    ObjectResult,
    SearchKind,
    SearchOrder,
    SearchRequest,
    SearchState,
    SearchStatus,
    StayOut,
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


SCHEMA: Literal[1] = 1
FILE_NAME = "search.json"
SET_ASIDE = "search.json.unreadable"
MAX_FILE_BYTES = 1_000_000  # a search for 20 objects takes 20 kB
MAX_REASON_CHARS = 200
MAX_NS = 4_000_000_000 * 10**9  # since 1970: dates up to 2096 can be told
MAX_NUMBER = 1e12  # of seconds and metres: no sum of them becomes infinite
# What reading a file of any content raises.
UNUSABLE = (ArithmeticError, LookupError, RecursionError, TypeError, ValueError)

Nanoseconds = Annotated[int, Field(ge=0, lt=MAX_NS)]


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


@dataclass(frozen=True, slots=True)
class _Document:
    """The file. Those of earlier releases lack what has a default here.

    search_id: it becomes the name of a file; elapsed_s and path_length_m: of the present object.
    """

    __pydantic_config__ = ConfigDict(strict=True)

    schema: Literal[1]
    search_id: Annotated[str, Field(pattern="^[A-Za-z0-9_-]{1,64}$")]
    objects: tuple[str, ...]
    results: tuple[ObjectResult, ...]
    started_ns: Nanoseconds
    elapsed_s: float
    path_length_m: float
    start_xy_m: tuple[float, float] | None
    kind: SearchKind = SearchKind.FIND
    place_m: tuple[float, ...] = ()
    order: SearchOrder = SearchOrder.GIVEN
    index: int | None = None
    done: tuple[int, ...] | None = None
    paused: tuple[PausedTarget, ...] = ()
    max_distance_m: float = 0.0
    max_time_s: float = 0.0
    details: Details = ()
    stay_out: StayOut = ()
    around: Surroundings = Surroundings()
    written_ns: Nanoseconds | None = None
    interrupted: str = ""


FILE = TypeAdapter(_Document)


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
    document = _Document(
        schema=SCHEMA,
        search_id=search.search_id,
        objects=search.objects,
        results=search.results,
        started_ns=search.started_ns,
        elapsed_s=now_s - search.target_start.since_s,
        path_length_m=odometer_m - search.target_start.odometer_m,
        start_xy_m=search.target_start.xy,
        kind=search.kind,
        place_m=search.destination.xy if search.destination else (),
        order=search.order,
        index=search.index,
        done=search.done,
        paused=search.paused,
        max_distance_m=search.budget.max_distance_m,
        max_time_s=search.budget.max_time_s,
        details=search.details,
        stay_out=search.stay_out,
        around=around,
        written_ns=now_ns,
    )
    with replacing(path) as file:
        file.write(FILE.dump_json(document))


def mark_interrupted(folder: Path, why: str) -> None:
    """Record that the search of the file has ended: no later planner goes on with it."""
    path = folder / FILE_NAME
    document = json.loads(path.read_text(encoding="utf-8"))
    with replacing(path) as file:
        file.write(json.dumps({**document, "interrupted": why}).encode())


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
        text = path.read_text(encoding="utf-8")
        number = _limited(float, MAX_NUMBER)
        json.loads(text, parse_float=number, parse_constant=number, parse_int=_limited(int, MAX_NS))
        document = FILE.validate_json(text)
        search, why = _search(document, now_s), document.interrupted[:MAX_REASON_CHARS]
        said = replace(search, reason=why or search.reason)
        decode(SearchStatus, encode(status(said, odometer_m=0.0, now_ns=0)))  # can be published
    except FileNotFoundError:
        return None
    except OSError as problem:
        raise JournalError(f"cannot read {path}: {problem}") from problem
    except UNUSABLE as problem:
        reason = repr(problem)[:MAX_REASON_CHARS]
        raise JournalError(f"{path} is not a search of schema {SCHEMA}: {reason}") from problem
    written_ns = search.started_ns if document.written_ns is None else document.written_ns
    return Recorded(search, document.around, written_ns, now_s, why)


def set_aside(folder: Path) -> str:
    """Rename a journal that cannot be used; returns what became of it, for people."""
    path = folder / FILE_NAME
    try:
        path.replace(folder / SET_ASIDE)
    except OSError as problem:
        return f"{path} cannot be renamed either: {problem.strerror}"
    return f"{path} is now {SET_ASIDE}"


def _search(document: _Document, now_s: float) -> Search:
    """The search of a file, whose elapsed seconds end at ``now_s``; ValueError if it is none."""
    request = SearchRequest(
        document.objects,
        kind=document.kind,
        place_m=document.place_m,
        order=document.order,
        max_distance_m=document.max_distance_m,
        max_time_s=document.max_time_s,
        details=document.details,
        stay_out=document.stay_out,
    )
    objects, count = request.objects, len(document.results)
    index = count if document.index is None else document.index
    done = tuple(range(count)) if document.done is None else document.done
    known, every = {*done, index}, set(range(max(len(objects), 1)))
    if len(known) != count + 1 or not known <= every:
        raise ValueError(f"object {index} is sought and {done} are done")
    if not {paused.index for paused in document.paused} <= every:
        raise ValueError("an object is put aside that the search does not have")
    search = new_search(
        document.search_id,
        objects[index : index + 1],
        EventStamp(now_s, 0.0, None, 0.0),
        document.started_ns,
        Destination.of(request),
        order=request.order,
    )
    since_s, odometer_m = now_s - document.elapsed_s, -document.path_length_m
    return replace(
        search,
        budget=Budget.of(request),
        details=request.details,
        stay_out=request.stay_out,
        objects=objects,
        index=index,
        results=document.results,
        target_start=TargetStart(since_s, 0.0, document.start_xy_m, odometer_m),
        done=done,
        paused=document.paused,
    )


def _limited(kind: Callable[[str], float], limit: float) -> Callable[[str], float]:
    """Reads a number of a JSON text: one that no search has is refused wherever it stands."""

    def number(text: str) -> float:
        if not abs(kind(text)) <= limit:  # also refuses NaN
            raise ValueError(f"{text[:20]} is larger than {limit:g}")
        return 0.0

    return number
