"""``onemap map``: commands on the map of a running robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from onemap_tools.options import HERE, Json, Token, Url

app = typer.Typer(no_args_is_help=True, help="Save, load, describe, export or clear the map.")
Name = Annotated[str, typer.Argument(help="Letters, digits, '.', '_' and '-'; no folder.")]


@app.command()
def save(name: Name, url: Url = HERE, token: Token = "", as_json: Json = False) -> None:
    """Write the map to a file in the mapper's map folder; an older one is replaced."""
    from onemap_tools.client import Gateway
    from onemap_tools.maps import describe_change
    from onemap_tools.terminal import print_json, result_console

    with Gateway(url, token) as door:
        change = door.map_save(name)
    describe_change(change, "Saved", result_console(as_json))
    if as_json:
        print_json(change)


@app.command()
def load(name: Name, url: Url = HERE, token: Token = "", as_json: Json = False) -> None:
    """Replace the map by a saved one; refused if another encoder made it."""
    from onemap_tools.client import Gateway
    from onemap_tools.maps import describe_change
    from onemap_tools.terminal import print_json, result_console

    with Gateway(url, token) as door:
        change = door.map_load(name)
    describe_change(change, "Loaded", result_console(as_json))
    if as_json:
        print_json(change)


@app.command()
def clear(url: Url = HERE, token: Token = "", as_json: Json = False) -> None:
    """Forget the map."""
    from onemap_tools.client import Gateway
    from onemap_tools.maps import describe_change
    from onemap_tools.terminal import print_json, result_console

    with Gateway(url, token) as door:
        change = door.map_clear()
    describe_change(change, "Cleared", result_console(as_json))
    if as_json:
        print_json(change)


@app.command()
def info(url: Url = HERE, token: Token = "", as_json: Json = False) -> None:
    """The map in numbers."""
    from onemap_tools.client import Gateway
    from onemap_tools.maps import describe_info
    from onemap_tools.terminal import print_json, result_console

    with Gateway(url, token) as door:
        document = door.map_info()
    describe_info(document, result_console(as_json))
    if as_json:
        print_json(document)


@app.command()
def export(
    file: Annotated[Path, typer.Argument(dir_okay=False, help="Where to write the .npz file.")],
    url: Url = HERE,
    token: Token = "",
    as_json: Json = False,
) -> None:
    """Write occupancy, layers and geometry to a NumPy archive on this machine."""
    from onemap_tools import maps
    from onemap_tools.client import Gateway
    from onemap_tools.terminal import print_json, result_console

    with Gateway(url, token) as door:
        document = maps.export(door, file)
    result_console(as_json).print(f"Wrote {document['path']}.", markup=False)
    if as_json:
        print_json(document)
