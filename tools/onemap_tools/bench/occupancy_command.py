"""``onemap bench occupancy``: free and occupied cells against the scene's geometry."""

from __future__ import annotations

from typing import Annotated

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.cli.options import Config, Json
from onemap_tools.cli.terminal import print_json


def occupancy(
    *,
    seeds: Annotated[str, typer.Option(help="Of the apartments: 1-4 or 3,5,8")] = "1-2",
    noise: Annotated[
        list[float] | None,
        typer.Option(min=0, max=0.1, help="Metres at 1 m, growing with d^2; default 0 and 0.005."),
    ] = None,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """How well free and occupied cells agree with the scene, with noisy depth.

    A camera drives along all of the floor of a generated apartment; depth only, no
    encoder. IoU: intersection over union with the cells that geometry touches between
    obstacle_min_height_m and obstacle_max_height_m, and with those that it does not,
    among the cells that are known. Occupied cells beside an obstacle count as neither:
    a surface on the border of two cells belongs to both.
    """
    with cli_errors("demo"):
        from onemap_mapper.config import MapperConfig
        from onemap_shared.config import read, section
        from onemap_tools.bench import occupancy as bench
        from onemap_tools.bench.claims import parse_seeds

        mapper = section(read(config), "mapper", MapperConfig)
        params = bench.OccupancyBenchParams(tuple(parse_seeds(seeds)), tuple(noise or (0.0, 0.005)))
        rows = []
        for row in bench.run(params, mapper):
            rows.append(row)
            typer.echo("  ".join(f"{name} {value}" for name, value in row.items()), err=as_json)
    if as_json:
        print_json({"benchmark": "occupancy", "results": rows})
