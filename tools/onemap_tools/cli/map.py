"""``onemap map``: save, load, merge, describe, export or clear the map of a running robot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from onemap_tools.cli.options import Json, Token, Url
from onemap_tools.map_export.layers import MapLayer
from onemap_tools.processes.network import DEFAULT_URL

if TYPE_CHECKING:
    from rich.console import Console

    from onemap import MapContent, MapFiles, MapStatistics

app = typer.Typer(
    no_args_is_help=True, help="Save, load, merge, describe, export or clear the map."
)
Name = Annotated[str, typer.Argument(help="Letters, digits, '.', '_' and '-'; no folder.")]


@app.command()
def save(name: Name, url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """Write the map to a file in the mapper's map folder; an older one is replaced."""
    from onemap_tools.cli.gateway_report import describe_change

    _request(url, token, as_json, lambda maps: maps.save(name), describe_change("Saved"))


@app.command()
def load(name: Name, url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """Replace the map by a saved one; refused if another encoder made it."""
    from onemap_tools.cli.gateway_report import describe_change

    _request(url, token, as_json, lambda maps: maps.load(name), describe_change("Loaded"))


@app.command()
def merge(
    name: Name,
    *,
    x: Annotated[float, typer.Option(help="Metres that it is moved along x.")] = 0.0,
    y: Annotated[float, typer.Option(help="Metres that it is moved along y.")] = 0.0,
    yaw: Annotated[
        float, typer.Option(help="Degrees that it is turned before, counter-clockwise.")
    ] = 0.0,
    url: Url = DEFAULT_URL,
    token: Token = "",
    as_json: Json = False,
) -> None:
    """Fuse a saved map into the map in use, of the same frame or moved into it.

    Features are weighted by the inverse of their variance: it does not matter which
    of both maps came first. Refused if another encoder made it.
    """
    from math import radians

    from onemap_tools.cli.gateway_report import describe_change

    def send(maps: MapFiles) -> MapContent:
        return maps.merge(name, x_m=x, y_m=y, yaw_rad=radians(yaw))

    _request(url, token, as_json, send, describe_change("Merged"))


@app.command()
def clear(url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """Forget the map."""
    from onemap_tools.cli.gateway_report import describe_change

    _request(url, token, as_json, lambda maps: maps.clear(), describe_change("Cleared"))


@app.command()
def info(url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """Extent, areas, memory and update rate of the map."""
    from onemap_tools.cli.gateway_report import describe_info

    _request(url, token, as_json, lambda maps: maps.info(), describe_info)


@app.command()
def export(
    file: Annotated[
        Path, typer.Argument(dir_okay=False, help="Ends in .npz, .png, .yaml, .geojson or .ply.")
    ],
    *,
    text: Annotated[
        list[str] | None,
        typer.Option(help="Also the similarity to it; for .geojson its regions, and repeatable."),
    ] = None,
    layer: Annotated[
        MapLayer, typer.Option(help="Of a .png file; similarity needs --text.")
    ] = MapLayer.OCCUPANCY,
    url: Url = DEFAULT_URL,
    token: Token = "",
    as_json: Json = False,
) -> None:
    """Write the map to a file on this machine, in the format of its ending.

    .npz: occupancy, layers and geometry for NumPy; .png: one layer, a pixel per cell,
    with a world file .pgw; .yaml: for nav2's map server, with a .pgm; .geojson: found
    objects, and the regions of each --text; .ply: the known cells as a point cloud.
    """
    from onemap_tools.cli.gateway_report import describe_export
    from onemap_tools.cli.map_export import export_map
    from onemap_tools.gateway import gateway_client

    with gateway_client(url, token) as gateway:
        written = export_map(gateway, file, texts=text or (), layer=layer)
    _print(written, as_json, describe_export)


def _request(
    url: str,
    token: str,
    as_json: bool,
    send: Callable[[MapFiles], MapContent | MapStatistics],
    describe: Callable[[dict[str, Any], Console], None],
) -> None:
    """Send a request to the gateway and print the reply."""
    from onemap_tools.gateway import gateway_client

    with gateway_client(url, token) as gateway:
        reply = dict(send(gateway.maps).document)
    _print(reply, as_json, describe)


def _print(
    document: dict[str, Any], as_json: bool, describe: Callable[[dict[str, Any], Console], None]
) -> None:
    from onemap_tools.cli.terminal import print_json, result_console

    describe(document, result_console(as_json))
    if as_json:
        print_json(document)
