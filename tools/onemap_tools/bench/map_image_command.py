"""``onemap bench map-image``: how long the gateway takes to draw the map."""

from __future__ import annotations

from typing import Annotated

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.cli.options import Json
from onemap_tools.cli.terminal import print_json


def map_image(
    *,
    seed: Annotated[int, typer.Option(min=0, help="Of the apartment.")] = 2,
    scale: Annotated[
        list[int] | None,
        typer.Option(min=1, max=32, help="Pixels per cell; repeat it. Default 8 and 24."),
    ] = None,
    repeats: Annotated[int, typer.Option(min=1, help="The least time of so many counts.")] = 5,
    as_json: Json = False,
) -> None:
    """How long the gateway takes for GET /v1/map.png of an apartment, with a heatmap.

    Processor time of one core: to draw the image, and to encode it as PNG. The occupancy is that
    of a drive through a generated apartment, the scores are drawn by the seed.
    """
    with cli_errors("demo"):
        from onemap_tools.bench import map_image as bench

        rows = []
        for row in bench.run(seed, scale or (8, 24), repeats):
            rows.append(row)
            typer.echo("  ".join(f"{name} {value}" for name, value in row.items()), err=as_json)
    if as_json:
        print_json({"benchmark": "map-image", "seed": seed, "results": rows})
