"""Runs ``onemap search`` and ``onemap go``: starts a search and shows it until it ends."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from rich.console import Console

from onemap import NO_LIMITS, Client, OneMapError, RemoteSearch, SearchLimits
from onemap_shared.messages import SearchKind, SearchOrder, SearchState
from onemap_tools.errors import EXIT_FAILED, EXIT_INTERRUPTED, EXIT_OK
from onemap_tools.gateway import SearchHandle
from onemap_tools.processes.interrupts import interruptible
from onemap_tools.progress import MapUpdates, progress_of, progress_view

POLL_S = 0.5


@dataclass(frozen=True, slots=True)
class Followed:
    """The final report of a search, and whether Ctrl-C cancelled it."""

    report: dict[str, Any]
    interrupted: bool

    def exit_code(self, *, done: bool) -> int:
        """That of the command: done, not done, or stopped before either was known."""
        if done:
            return EXIT_OK
        return EXIT_INTERRUPTED if self.interrupted else EXIT_FAILED


def map_updates(gateway: Client) -> MapUpdates:
    """Age and rate of the map's revisions as the gateway reports them; both None without a reply.

    The gateway answers from its cache, without a call to the mapper.
    """
    try:
        streams = gateway.status().streams
    except OneMapError:
        return MapUpdates()
    revisions = [stream for stream in streams if stream.name == "revision"]
    return MapUpdates(revisions[0].age_s, revisions[0].rate_hz) if revisions else MapUpdates()


def search(
    gateway: Client,
    objects: tuple[str, ...],
    console: Console,
    *,
    any_order: bool = False,
    limits: SearchLimits = NO_LIMITS,
) -> Followed:
    """Search for the objects one after the other; Ctrl-C cancels."""
    start = partial(gateway.search, objects, any_order=any_order, limits=limits)
    return _follow(gateway, start, console)


def drive(
    gateway: Client,
    place_m: tuple[float, float],
    console: Console,
    *,
    look: bool,
    limits: SearchLimits = NO_LIMITS,
) -> Followed:
    """Drive to a place, or to where it can be seen; Ctrl-C cancels."""
    start = gateway.look_at if look else gateway.go_to
    return _follow(gateway, lambda: start(*place_m, limits=limits), console)


def _follow(gateway: Client, start: Callable[[], RemoteSearch], console: Console) -> Followed:
    interrupted = False
    with interruptible() as stop, progress_view(console) as view:
        handle = SearchHandle(start())
        while handle.active:
            view.show(progress_of(handle.report, map_updates(gateway)))
            if stop.wait(POLL_S):
                handle.cancel()
                interrupted = True
                break
            if problem := handle.poll():
                view.wait(handle.report["elapsed_s"], problem)
    return Followed(handle.report, interrupted)


def all_found(report: dict[str, Any]) -> bool:
    """Whether every object of the search was found."""
    found = [r["name"] for r in report["results"] if r["outcome"] == SearchState.FOUND.value]
    return len(found) == len(report["objects"])


def arrived(report: dict[str, Any]) -> bool:
    """Whether a drive has reached its place, or a view of it."""
    return bool(report["state"] == SearchState.ARRIVED.value)


def again(report: dict[str, Any]) -> str:
    """How to start an interrupted search again, in a sentence; empty for any other."""
    if report.get("state") != SearchState.INTERRUPTED.value:
        return ""
    if report["place_m"]:
        look = ["--look"] if report["kind"] == SearchKind.LOOK_AT.value else []
        words = ["go", *look, *map(str, report["place_m"])]
    else:
        found = {r["name"] for r in report["results"] if r["outcome"] == SearchState.FOUND.value}
        any_order = ["--any-order"] if report["order"] == SearchOrder.ANY.value else []
        words = ["search", *any_order, *(n for n in report["objects"] if n not in found)]
    return f"The last search was {report['reason']}. Search again: {shlex.join(['onemap', *words])}"


def interrupted(gateway: Client) -> str:
    """``again`` for the newest search; empty if there is none, or the planner does not answer."""
    try:
        return again(dict(gateway.searches.get().latest.document))
    except OneMapError:
        return ""
