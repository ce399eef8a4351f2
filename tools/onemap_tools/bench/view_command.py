"""``onemap bench view``."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.cli.options import Json
from onemap_tools.cli.terminal import print_json


def view(
    *,
    size: Annotated[
        list[int] | None,
        typer.Option(min=10, max=380, help="Metres; default 10, 50, 100 and 200."),
    ] = None,
    frames: Annotated[int, typer.Option(min=1, help="Frames to measure in each map.")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="Of features and texts.")] = 0,
    as_json: Json = False,
) -> None:
    """What a frame and a planner's view of the map cost, by the size of the map.

    A square of floor, every cell seen. After each frame the planner's view for an
    object with two rivals is asked for: as what changed, as the services do, and as
    a whole. Processor time of the mapper, with the message, and of the planner, from
    the message to a window of 10 m around the robot; and bytes. "first" is the view
    with which a search begins. At the end both views must be equal bit for bit.
    """
    with cli_errors("planner"):
        from onemap_tools.bench.map_views import SIZES_M, ViewBenchOptions, run

        result = run(ViewBenchOptions(tuple(size or SIZES_M), frames, seed))
    if as_json:
        print_json(result)
    else:
        print("\n".join(table_lines(result)))


def table_lines(result: dict[str, Any]) -> list[str]:
    """One line for each size: the frame, then bytes and times of each kind of view."""
    lines = ["size_m   fuse_ms   view        bytes   mapper_ms  planner_ms"]
    for row in result["results"]:
        for kind in ("changes", "first", "whole"):
            cost = row[kind]
            lines.append(
                f"{row['size_m']:6}  {row['fuse_ms']['min']:8.2f}   {kind:7} "
                f"{cost['bytes_p50']:9}  {cost['mapper_ms']['min']:10.2f}  "
                f"{cost['planner_ms']['min']:10.2f}"
            )
    return lines
