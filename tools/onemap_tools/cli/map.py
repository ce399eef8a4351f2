"""``onemap map``: save, load, describe, export or clear the map of a running robot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from onemap_tools.cli.options import Json, Token, Url
from onemap_tools.processes.network import DEFAULT_URL

if TYPE_CHECKING:
    from rich.console import Console

    from onemap_tools.client import GatewayClient

app = typer.Typer(no_args_is_help=True, help="Save, load, describe, export or clear the map.")
Name = Annotated[str, typer.Argument(help="Letters, digits, '.', '_' and '-'; no folder.")]


@app.command()
def save(name: Name, url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """Write the map to a file in the mapper's map folder; an older one is replaced."""
    from onemap_tools.cli.gateway_report import describe_change

    _request(url, token, as_json, lambda gateway: gateway.map_save(name), describe_change("Saved"))


@app.command()
def load(name: Name, url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """Replace the map by a saved one; refused if another encoder made it."""
    from onemap_tools.cli.gateway_report import describe_change

    _request(url, token, as_json, lambda gateway: gateway.map_load(name), describe_change("Loaded"))


@app.command()
def clear(url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """Forget the map."""
    from onemap_tools.cli.gateway_report import describe_change

    _request(url, token, as_json, lambda gateway: gateway.map_clear(), describe_change("Cleared"))


@app.command()
def info(url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """Extent, areas, memory and update rate of the map."""
    from onemap_tools.cli.gateway_report import describe_info

    _request(url, token, as_json, lambda gateway: gateway.map_info(), describe_info)


@app.command()
def export(
    file: Annotated[Path, typer.Argument(dir_okay=False, help="Where to write the .npz file.")],
    url: Url = DEFAULT_URL,
    token: Token = "",
    as_json: Json = False,
) -> None:
    """Write occupancy, layers and geometry to a NumPy archive on this machine."""
    from onemap_tools.cli.gateway_report import describe_export, write_archive

    _request(url, token, as_json, lambda gateway: write_archive(gateway, file), describe_export)


def _request(
    url: str,
    token: str,
    as_json: bool,
    send: Callable[[GatewayClient], dict[str, Any]],
    describe: Callable[[dict[str, Any], Console], None],
) -> None:
    """Send a request to the gateway and print the reply."""
    from onemap_tools.cli.terminal import print_json, result_console
    from onemap_tools.client import GatewayClient

    with GatewayClient(url, token) as gateway:
        reply = send(gateway)
    describe(reply, result_console(as_json))
    if as_json:
        print_json(reply)
