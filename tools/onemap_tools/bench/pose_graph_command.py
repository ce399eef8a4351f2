"""``onemap bench pose-graph``: what a corrected pose gives back to the map."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.cli.options import Json
from onemap_tools.cli.terminal import print_json


def pose_graph(
    *,
    seeds: Annotated[str, typer.Option(help="Of the apartments: 1-4 or 3,5,8")] = "1-4",
    drift: Annotated[
        float, typer.Option(min=0, max=0.5, help="Metres too much per metre of way.")
    ] = 0.02,
    yaw_drift: Annotated[
        float, typer.Option(min=-10, max=10, help="Degrees turned too far per metre of way.")
    ] = 0.25,
    out: Annotated[
        Path | None, typer.Option(file_okay=False, help="Write a picture of the maps here.")
    ] = None,
    as_json: Json = False,
) -> None:
    """What the map loses by drift, and gets back by robot/pose_graph.

    A drive through a generated apartment and back to its start with drifting
    odometry, a loop closure, and a third of the way once more. The closure shares
    its error out over the way; it does not know the truth. Wrong occupied: share of
    the occupied cells without an obstacle in or beside them; wrong free: share of
    the cells inside of obstacles that are free; similarity: distance of the best
    answer for each object to the nearest such object. Milliseconds are processor time.
    """
    with cli_errors("demo"):
        from onemap_tools.bench import pose_graph as bench
        from onemap_tools.bench.claims import parse_seeds

        params = bench.PoseGraphBenchParams(tuple(parse_seeds(seeds)), drift, yaw_drift, out)
        result = bench.run(params)
    typer.echo("\n".join(bench.table_lines(result)), err=as_json)
    if as_json:
        print_json(result)
