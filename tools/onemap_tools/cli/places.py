"""``onemap places``: rooms with a name and zones that no robot enters."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from onemap_tools.cli.options import FIRST, OPERATE, Json, Token, Url
from onemap_tools.cli.terminal import asked, confirmed, show
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.network import DEFAULT_URL

app = typer.Typer()
Name = Annotated[str, typer.Argument(help="Its case does not matter.")]


@app.command(rich_help_panel=FIRST)
def places(url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """Rooms with a name, zones that no robot enters, and suggested names."""
    listed = asked(url, token, lambda gateway: gateway.places().places)
    _show([dict(each.document) for each in listed], as_json)


@app.command("places name", rich_help_panel=OPERATE)
def name_place(
    name: Name,
    *,
    at: Annotated[str, typer.Option(help="x,y of a point in the room, metres.")] = "",
    corners: Annotated[
        str,
        typer.Option(
            help="Corners of a polygon instead: x,y of each in metres, with spaces between."
        ),
    ] = "",
    keep_out: Annotated[
        bool, typer.Option("--keep-out", help="No robot enters it from now on.")
    ] = False,
    url: Url = DEFAULT_URL,
    token: Token = "",
    as_json: Json = False,
) -> None:
    """Name a room or a polygon; by default the room in which the robot stands."""
    if at and corners:
        raise typer.BadParameter("give --at or --corners, or neither for the robot's room")
    inside_m = parse_points(at, "--at")
    if len(inside_m) > 1:
        raise typer.BadParameter("--at is one point; a polygon has --corners")
    corners_m = parse_points(corners, "--corners")
    place_m = inside_m[0] if inside_m else None
    place = asked(
        url,
        token,
        lambda gateway: gateway.name_place(name, place_m, corners_m=corners_m, keep_out=keep_out),
    )
    _show([dict(place.document)], as_json)


@app.command("places forget", rich_help_panel=OPERATE)
def forget_place(
    name: Name, url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False
) -> None:
    """Remove a name or a zone; the map stays."""
    forgotten = asked(url, token, lambda gateway: dict(gateway.forget_place(name).document))
    show(
        forgotten,
        as_json,
        lambda place, console: console.print(f"Forgot {place['name']}.", soft_wrap=True),
    )


@app.command("places reset", rich_help_panel=OPERATE)
def reset_places(
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
    url: Url = DEFAULT_URL,
    token: Token = "",
    as_json: Json = False,
) -> None:
    """Remove all names and zones, also those that cannot be read; the map stays."""
    question = "Forget all places? Robots then drive into what was a keep-out zone."
    if not (yes or confirmed(question)):
        raise CliError("Nothing was changed: '--yes' says that there are no zones.")
    left = asked(url, token, lambda gateway: gateway.forget_places())
    show({"places": [dict(each.document) for each in left.places]}, as_json, _describe_reset)


def _describe_reset(_reply: dict[str, Any], console: Console) -> None:
    console.print("No place has a name now, and no zone is kept out.")


def parse_points(text: str, option: str) -> list[tuple[float, float]]:
    """x, y in metres of each ``x,y`` of a text."""
    try:
        return [(float(x), float(y)) for x, y in (point.split(",") for point in text.split())]
    except ValueError as problem:
        raise CliError(
            f"{option} is {text!r}; write x,y in metres, and more of them with spaces between, as "
            "in '0,0 2,0 2,1.5'",
            EXIT_USAGE_ERROR,
        ) from problem


def _show(places: list[dict[str, Any]], as_json: bool) -> None:
    """Print one row per place."""

    def describe(reply: dict[str, Any], console: Console) -> None:
        if not reply["places"]:
            console.print("No place has a name yet: 'onemap places name' gives one.")
            return
        table = Table("place", "kind", "area", "at")
        for place in reply["places"]:
            x_m, y_m = place["inside_m"] or place["corners_m"][0]
            kind = place["kind"].replace("_", " ") + (", suggested" if place["suggested"] else "")
            area = f"{place['area_m2']:.1f} m2" if place["outlines_m"] else "no room there yet"
            table.add_row(place["name"] or "-", kind, area, f"({x_m:.2f}, {y_m:.2f}) m")
        console.print(table)

    show({"places": places}, as_json, describe)
