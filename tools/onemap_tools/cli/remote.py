"""What commands that ask a running robot do with its gateway: follow a search, print a reply."""

# Talks: the clock.

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from onemap import Client, OneMapError, RemoteSearch
from onemap_shared.messages import SearchState, check_image
from onemap_tools.errors import (
    EXIT_FAILED,
    EXIT_INTERRUPTED,
    EXIT_OK,
    EXIT_USAGE_ERROR,
    CliError,
)
from onemap_tools.gateway import SearchHandle
from onemap_tools.processes.interrupts import interruptible
from onemap_tools.progress import ProgressLines

POLL_S = 0.5
MAY_DRIVE = (
    "The robot may still drive: no stop was confirmed. Use its emergency stop, or end the planner."
)
CONDITION_COLOURS = {"ok": "green", "degraded": "yellow", "down": "red"}


def follow(
    gateway: Client, start: Callable[[], RemoteSearch], console: Console, *, again: bool = False
) -> tuple[dict[str, Any], int]:
    """Start a search or a drive and show it until it ends; Ctrl-C cancels.

    again: ask for what is left when its planner or driver has ended, as long as this runs.
    Returns the final report and the exit code: done, not done, or stopped before either was known.
    """
    interrupted = False
    lines = ProgressLines(console)
    with interruptible(lambda: console.print(MAY_DRIVE, soft_wrap=True)) as stop:
        handle = SearchHandle(start())
        if understood := _understood(handle.report):
            console.print(understood, soft_wrap=True)
        problem, heard_s = "", time.monotonic()
        while handle.active or (again and handle.interrupted):
            if not problem:
                heard_s = time.monotonic()
                with stop.breaking():
                    lines.show(handle.report, gateway)
            if stop.wait(POLL_S):
                console.print("Stopping the robot.")
                handle.cancel(partial(_say_not_stopped, console))
                interrupted = True
                break
            if handle.active:
                with stop.breaking():
                    problem = handle.poll()
            else:
                problem = handle.again()
            if problem:
                lines.wait(handle.report["elapsed_s"] + time.monotonic() - heard_s, problem)
    if is_done(handle.report):
        return handle.report, EXIT_OK
    return handle.report, EXIT_INTERRUPTED if interrupted else EXIT_FAILED


def _say_not_stopped(console: Console, why: str) -> None:
    console.print(f"Not stopped yet, trying again (Ctrl-C: give up): {why}", soft_wrap=True)


def _understood(reply: dict[str, Any]) -> str:
    """How sentences were understood, in a line; empty for a place or an image."""
    understood = reply.get("understood", "")  # older gateways have no such key
    return f"Understood as: {understood}." if understood else ""


def is_done(report: dict[str, Any]) -> bool:
    """Whether every object of a search was found, or a drive has reached its place."""
    if not report["objects"]:
        return bool(report["state"] == SearchState.ARRIVED.value)
    return len(_found(report)) == len(report["objects"])


def _found(report: dict[str, Any]) -> list[str]:
    return [r["name"] for r in report["results"] if r["outcome"] == SearchState.FOUND.value]


def again(report: dict[str, Any]) -> str:
    """How to go on with an interrupted search, in a sentence; empty for any other."""
    if report.get("state") != SearchState.INTERRUPTED.value:
        return ""
    return f"The last search was {report['reason']}. Continue it with 'onemap search --again'."


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


def describe_search(report: dict[str, Any], console: Console) -> None:
    """Print one row per object: outcome, position, time, path and reason."""
    table = Table("object", "outcome", "where", "time", "path", "reason")
    for result in report["results"]:
        table.add_row(
            result["name"],
            result["outcome"].replace("_", " "),
            "\n".join(filter(None, (result.get("where"), _place(result["position_m"])))),
            f"{result['duration_s']:.0f} s",
            f"{result['path_length_m']:.1f} m",
            result["reason"],
        )
    console.print(table)
    if not is_done(report):
        console.print(again(report) or report["reason"], soft_wrap=True)


def describe_drive(report: dict[str, Any], console: Console) -> None:
    """Print how a drive to a place ended, in a line."""
    driven = f"{report['elapsed_s']:.0f} s, {report['path_length_m']:.1f} m"
    ended = f"{report['state'].capitalize()}: {report['reason']} ({driven})."
    console.print(again(report) or ended, soft_wrap=True)


def describe_queries(reply: dict[str, Any], console: Console) -> None:
    """Print the answer to one text, or to each of several."""
    for each in reply.get("answers", [reply]):
        describe_query(each, console)


def describe_query(reply: dict[str, Any], console: Console) -> None:
    """Print the regions of the map that match, best first."""
    if understood := _understood(reply):
        console.print(understood, soft_wrap=True)
    if sentence := reply.get("sentence"):  # older gateways have no such key
        console.print(sentence, soft_wrap=True)
    if not reply["regions"]:
        console.print(reply["message"], soft_wrap=True)
        return
    names = ("", "where", "last seen (UTC)", "centre", "height", "score")
    table = Table(*names, title=reply.get("request") or reply["text"])
    for region in reply["regions"]:
        band = region.get("height_m")
        told = [region.get("where", ""), *map(_checked, region.get("conditions", ()))]
        table.add_row(
            str(region["rank"]),
            "\n".join(filter(None, told)),
            (region.get("last_seen_at") or "")[11:19],
            _place(region["centre_m"][:2]),
            f"{band[0]:.1f} to {band[1]:.1f} m" if band else "",
            f"{region['score']:.2f}",
        )
    console.print(table)
    if picture := reply["regions"][0].get("picture"):
        console.print(f"Its photograph: GET {picture}", soft_wrap=True)


def _checked(condition: dict[str, str]) -> str:
    """A condition of the description, and whether it holds there."""
    return f"{condition['what']}: {condition['holds'].replace('_', ' ')}, {condition['evidence']}"


def describe_searches(reply: dict[str, Any], console: Console) -> None:
    """Print one row per search: when, what, how it ended, how long and far, id."""
    if not reply["searches"]:
        console.print("Nothing was searched yet: 'onemap search' goes and looks.")
        return
    table = Table("began (UTC)", "what", "state", "time", "driven", "id")
    for each in reply["searches"]:
        table.add_row(
            each["started_at"][:19].replace("T", " "),
            ", ".join(each["objects"])
            or f"{each['kind'].replace('_', ' ')} {_place(each['place_m'])}",
            each["state"].replace("_", " "),
            f"{each['elapsed_s']:.0f} s",
            f"{each['path_length_m']:.1f} m",
            each["id"],
        )
    console.print(table)


def describe_objects(reply: dict[str, Any], console: Console) -> None:
    """Print one row per found object: name, place, score, times, id."""
    if not reply["objects"]:
        console.print("Nothing was found on this map yet: 'onemap search' goes and looks.")
        return
    table = Table("object", "where", "found", "last seen (UTC)", "position", "score", "id")
    for known in reply["objects"]:
        table.add_row(
            known["name"],
            known.get("where", ""),
            f"{known['times_found']} x",
            known["last_seen_at"][:19].replace("T", " "),
            _place(known["position_m"][:2]),
            f"{known['score']:.2f}",
            known["id"],
        )
    console.print(table)
    if pictured := next((each["picture"] for each in reply["objects"] if each["picture"]), None):
        console.print(f"Their photographs: GET {pictured}, of each id.", soft_wrap=True)


def describe_status(status: dict[str, Any], console: Console) -> None:
    """Print services and streams as the gateway reports them."""
    services = Table("service", "condition", "what is wrong")
    for service in status["services"]:
        condition = service["condition"]
        coloured = Text(condition, style=CONDITION_COLOURS.get(condition, ""))
        services.add_row(service["name"], coloured, service["problem"])
    streams = Table("stream", "age", "rate", "received", "missed", "refused")
    for stream in status["streams"]:
        age = "never" if stream["age_s"] is None else f"{stream['age_s']:.1f} s"
        counts = (str(stream[name]) for name in ("received", "missed", "refused"))
        streams.add_row(stream["name"], age, f"{stream['rate_hz']:.1f} Hz", *counts)
    console.print(services, streams)
    console.print("Ready." if status["ready"] else f"Not ready. {status['problem']}")


def _place(position_m: list[float] | None) -> str:
    """Coordinates in metres; empty without any."""
    return f"({', '.join(f'{value:.2f}' for value in position_m)}) m" if position_m else ""
