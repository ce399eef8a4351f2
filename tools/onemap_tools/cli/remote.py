"""What commands that ask a running robot do with its gateway: follow a search, print a reply."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from math import degrees
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from onemap import (
    NO_LIMITS,
    Client,
    OneMapError,
    QueryEvent,
    QueryInterrupted,
    RemoteSearch,
    SearchLimits,
)
from onemap_shared.messages import SearchKind, SearchOrder, SearchState, check_image
from onemap_tools.cli.terminal import print_json, progress_console, result_console
from onemap_tools.errors import (
    EXIT_FAILED,
    EXIT_INTERRUPTED,
    EXIT_OK,
    EXIT_USAGE_ERROR,
    CliError,
)
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


def read_crop(path: Path) -> bytes:
    """A PNG or JPEG that may be asked for; CliError says what is wrong with another file."""
    try:
        data = path.read_bytes()
        check_image(data)
    except OSError as problem:
        raise CliError(f"cannot read {path}: {problem.strerror}", EXIT_USAGE_ERROR) from problem
    except ValueError as problem:
        raise CliError(f"{path}: {problem}", EXIT_USAGE_ERROR) from problem
    return data


CONDITION_COLOURS = {"ok": "green", "degraded": "yellow", "down": "red"}


def describe_search(report: dict[str, Any], console: Console) -> None:
    """Print one row per object: outcome, position, time, path and reason."""
    table = Table("object", "outcome", "position", "time", "path", "reason")
    for result in report["results"]:
        place = ", ".join(f"{value:.2f}" for value in result["position_m"] or ())
        table.add_row(
            result["name"],
            result["outcome"].replace("_", " "),
            f"({place}) m" if place else "",
            f"{result['duration_s']:.0f} s",
            f"{result['path_length_m']:.1f} m",
            result["reason"],
        )
    console.print(table)
    if not all_found(report):
        console.print(again(report) or report["reason"], soft_wrap=True)


def describe_drive(report: dict[str, Any], console: Console) -> None:
    """Print how a drive to a place ended, in a line."""
    driven = f"{report['elapsed_s']:.0f} s, {report['path_length_m']:.1f} m"
    ended = f"{report['state'].capitalize()}: {report['reason']} ({driven})."
    console.print(Text(again(report) or ended), soft_wrap=True)


def describe_query(reply: dict[str, Any], console: Console) -> None:
    """Print the regions of the map that match, best first."""
    if sentence := reply.get("sentence"):  # older gateways have no such key
        console.print(Text(sentence), soft_wrap=True)
    if not reply["regions"]:
        console.print(Text(reply["message"]), soft_wrap=True)
        return
    names = ("", "centre", "size", "height", "score", "best seen from", "last seen (UTC)")
    table = Table(*names, title=reply["text"])
    for region in reply["regions"]:
        x_min, y_min, x_max, y_max = region["extent_m"]
        table.add_row(
            str(region["rank"]),
            f"({region['centre_m'][0]:.2f}, {region['centre_m'][1]:.2f}) m",
            f"{x_max - x_min:.1f} x {y_max - y_min:.1f} m",
            _height(region.get("height_m")),
            f"{region['score']:.2f}",
            _view(region.get("best_view")),
            (region.get("last_seen_at") or "")[11:19],
        )
    console.print(table)
    if near := reply.get("did_you_mean"):  # older gateways have no such key
        console.print(
            f"The encoder does not know {reply['text']!r}; did you mean "
            f"{' or '.join(repr(word) for word in near)}?"
        )


def follow_query(events: Iterable[QueryEvent], *, as_json: bool) -> None:
    """Print each answer as it comes, with JSON one object in a line; ends by Ctrl-C."""
    for event in events:
        if isinstance(event, QueryInterrupted):
            progress_console().print(Text(event.detail), soft_wrap=True)
        elif as_json:
            print_json(dict(event.document))
        else:
            describe_query(dict(event.document), result_console(as_json))


def _height(band: list[float] | None) -> str:
    return f"{band[0]:.1f} to {band[1]:.1f} m" if band else ""


def _view(view: dict[str, float] | None) -> str:
    if view is None:
        return ""
    return f"({view['x_m']:.2f}, {view['y_m']:.2f}) m, {degrees(view['yaw_rad']):.0f}°"


def describe_objects(reply: dict[str, Any], console: Console) -> None:
    """Print one row per found object: name, place, score, times, id."""
    if not reply["objects"]:
        console.print("Nothing was found on this map yet: 'onemap search' goes and looks.")
        return
    table = Table("object", "position", "score", "found", "last seen (UTC)", "id")
    for known in reply["objects"]:
        place = ", ".join(f"{value:.2f}" for value in known["position_m"])
        table.add_row(
            Text(known["name"]),
            f"({place}) m",
            f"{known['score']:.2f}",
            f"{known['times_found']} x",
            known["last_seen_at"][:19].replace("T", " "),
            known["id"],
        )
    console.print(table)


def describe_status(status: dict[str, Any], console: Console) -> None:
    """Print services and streams as the gateway reports them."""
    services = Table("service", "condition", "what is wrong")
    for service in status["services"]:
        condition = Text(
            service["condition"], style=CONDITION_COLOURS.get(service["condition"], "")
        )
        services.add_row(service["name"], condition, Text(service["problem"]))
    streams = Table("stream", "age", "rate", "received", "missed", "refused")
    for stream in status["streams"]:
        age_s = stream["age_s"]
        streams.add_row(
            stream["name"],
            "never" if age_s is None else f"{age_s:.1f} s",
            f"{stream['rate_hz']:.1f} Hz",
            str(stream["received"]),
            str(stream["missed"]),
            str(stream["refused"]),
        )
    console.print(services, streams)
    console.print(Text("Ready." if status["ready"] else f"Not ready. {status['problem']}"))


def describe_change(done: str) -> Callable[[dict[str, Any], Console], None]:
    """A printer for the reply to save, load or clear; ``done`` is the verb in the past tense."""

    def describe(change: dict[str, Any], console: Console) -> None:
        what = f"{done} {change['path']}".rstrip()
        held = f"{change['cells_observed']} cells from {change['frames_fused']} frames"
        size = f", {change['file_bytes'] / 1e6:.1f} MB" if change["file_bytes"] else ""
        console.print(Text(f"{what}: {held}{size}."), soft_wrap=True)

    return describe


def describe_info(info: dict[str, Any], console: Console) -> None:
    """Print extent, areas, memory and update rate of the map."""
    x_min, y_min, x_max, y_max = info["bounds_m"]
    age = "empty" if info["age_s"] is None else f"{info['age_s']:.1f} s"
    table = Table.grid(padding=(0, 2))
    for name, value in (
        ("revision", str(info["revision"])),
        ("newest frame", age),
        ("extent", f"{x_max - x_min:.1f} x {y_max - y_min:.1f} m"),
        ("observed", f"{info['observed_m2']:.1f} m2"),
        ("free", f"{info['free_m2']:.1f} m2"),
        ("occupied", f"{info['occupied_m2']:.1f} m2"),
        ("memory", f"{info['memory_bytes'] / 1e6:.1f} MB"),
        ("updates", f"{info['rate_hz']:.1f} Hz, {info['update_ms']:.0f} ms each"),
        ("encoder", f"{info['encoder_id']} ({info['text_space']})"),
    ):
        table.add_row(name, Text(value))
    console.print(table)


def describe_export(written: dict[str, Any], console: Console) -> None:
    """Print paths and size of what was written."""
    paths = " and ".join([written["path"], *written.get("beside", ())])
    console.print(Text(f"Wrote {paths}, {written['file_bytes']} bytes."), soft_wrap=True)
