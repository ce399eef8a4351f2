"""Prints what the gateway replied to a query, a search, or a request for objects, status or map."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import degrees
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from onemap import QueryEvent, QueryInterrupted
from onemap_tools.cli.search import again, all_found
from onemap_tools.cli.terminal import print_json, progress_console, result_console

COLOURS = {"ok": "green", "degraded": "yellow", "down": "red"}


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


def describe_drive(report: dict[str, Any]) -> Text:
    """How a drive to a place ended, in a line."""
    driven = f"{report['elapsed_s']:.0f} s, {report['path_length_m']:.1f} m"
    ended = f"{report['state'].capitalize()}: {report['reason']} ({driven})."
    return Text(again(report) or ended)


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


def describe_objects(objects: list[dict[str, Any]], console: Console) -> None:
    """Print one row per found object: name, place, score, times, id."""
    if not objects:
        console.print("Nothing was found on this map yet: 'onemap search' goes and looks.")
        return
    table = Table("object", "position", "score", "found", "last seen (UTC)", "id")
    for known in objects:
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
        condition = Text(service["condition"], style=COLOURS.get(service["condition"], ""))
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
