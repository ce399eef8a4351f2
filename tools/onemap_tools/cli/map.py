"""``onemap map``: what a robot's map holds, and the maps that were saved."""

from __future__ import annotations

from collections.abc import Callable
from math import radians
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from onemap_tools.cli.options import Json, Token, Url
from onemap_tools.cli.terminal import asked, show
from onemap_tools.processes.network import DEFAULT_URL

if TYPE_CHECKING:
    from onemap import MapContent, MapFiles


app = typer.Typer(
    no_args_is_help=True, help="Save, list, load, merge, delete, describe or clear maps."
)
Name = Annotated[str, typer.Argument(help="Letters, digits, '.', '_' and '-'; no folder.")]


@app.command()
def save(name: Name, url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """Write the map to a file in the mapper's map folder; an older one is replaced."""
    _change(url, token, as_json, lambda maps: maps.save(name), "Saved")


@app.command()
def load(name: Name, url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """Replace the map by a saved one; refused if another encoder made it."""
    _change(url, token, as_json, lambda maps: maps.load(name), "Loaded")


@app.command()
def merge(
    name: Name,
    *,
    x: Annotated[float, typer.Option(help="Metres that it is moved along x.")] = 0.0,
    y: Annotated[float, typer.Option(help="Metres that it is moved along y.")] = 0.0,
    yaw: Annotated[
        float, typer.Option(help="Degrees that it is turned first, counter-clockwise.")
    ] = 0.0,
    url: Url = DEFAULT_URL,
    token: Token = "",
    as_json: Json = False,
) -> None:
    """Fuse a saved map into the map in use, of the same frame or moved into it.

    Features are weighted by the inverse of their variance: it does not matter which
    of both maps came first. Refused if another encoder made it.
    """

    def send(maps: MapFiles) -> MapContent:
        return maps.merge(name, x_m=x, y_m=y, yaw_rad=radians(yaw))

    _change(url, token, as_json, send, "Merged")


@app.command(name="list")
def list_maps(url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """The saved maps, the newest first."""
    saved = asked(url, token, lambda gateway: gateway.maps.list())

    def describe(reply: dict[str, Any], console: Console) -> None:
        if not reply["maps"]:
            console.print("No map was saved yet: 'onemap map save NAME' does.")
            return
        table = Table("map", "saved (UTC)", "cells", "frames", "size", "encoder")
        for each in reply["maps"]:
            counts = (str(each[key]) for key in ("cells_observed", "frames_fused"))
            size = f"{each['file_bytes'] / 1e6:.1f} MB"
            what = each["problem"] or each["encoder_id"]
            table.add_row(each["name"], _clock(each["saved_at"]), *counts, size, what)
        console.print(table)

    show({"maps": [dict(each.document) for each in saved]}, as_json, describe)


@app.command()
def delete(name: Name, url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """Delete a saved map; the map in use stays."""
    deleted = asked(url, token, lambda gateway: dict(gateway.maps.delete(name).document))

    def describe(gone: dict[str, Any], console: Console) -> None:
        console.print(f"Deleted {gone['name']}, saved {_clock(gone['saved_at'])} UTC.")

    show(deleted, as_json, describe)


def _clock(rfc3339: str) -> str:
    return rfc3339[:19].replace("T", " ")


@app.command()
def clear(url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """Forget the map."""
    _change(url, token, as_json, lambda maps: maps.clear(), "Cleared")


@app.command()
def info(url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """Extent, areas, memory and update rate of the map."""
    document = asked(url, token, lambda gateway: dict(gateway.maps.info().document))
    show(document, as_json, _describe_info)


def _change(
    url: str, token: str, as_json: bool, send: Callable[[MapFiles], MapContent], done: str
) -> None:
    """Send a request to the gateway and print what the map holds then.

    done: the verb in the past tense.
    """
    document = asked(url, token, lambda gateway: dict(send(gateway.maps).document))

    def describe(change: dict[str, Any], console: Console) -> None:
        what = f"{done} {change['path']}".rstrip()
        held = f"{change['cells_observed']} cells from {change['frames_fused']} frames"
        size = f", {change['file_bytes'] / 1e6:.1f} MB" if change["file_bytes"] else ""
        console.print(f"{what}: {held}{size}.", soft_wrap=True)
        if stayed := change.get("places_stayed"):  # older gateways have no such key
            console.print(f"Places that stay as they were: {', '.join(stayed)}.", soft_wrap=True)

    show(document, as_json, describe)


def _describe_info(info: dict[str, Any], console: Console) -> None:
    """Print extent, areas, memory and update rate of the map."""
    x_min, y_min, x_max, y_max = info["bounds_m"]
    table = Table.grid(padding=(0, 2))
    for name, value in (
        ("revision", str(info["revision"])),
        ("newest frame", "empty" if info["age_s"] is None else f"{info['age_s']:.1f} s"),
        ("extent", f"{x_max - x_min:.1f} x {y_max - y_min:.1f} m"),
        *((area, f"{info[f'{area}_m2']:.1f} m2") for area in ("observed", "free", "occupied")),
        ("memory", f"{info['memory_bytes'] / 1e6:.1f} MB"),
        ("updates", f"{info['rate_hz']:.1f} Hz, {info['update_ms']:.0f} ms each"),
        ("encoder", f"{info['encoder_id']} ({info['text_space']})"),
    ):
        table.add_row(name, value)
    console.print(table)
