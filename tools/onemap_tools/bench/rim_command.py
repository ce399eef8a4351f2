"""``onemap bench rim``."""

from __future__ import annotations

from typing import Annotated

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.cli.options import Json
from onemap_tools.cli.terminal import print_json


def rim(
    *,
    seeds: Annotated[str, typer.Option(help="Of apartments, by commas; even ones choose.")] = "2,4",
    every: Annotated[
        int, typer.Option(min=1, help="The blurred maps are made of every n-th image.")
    ] = 4,
    as_json: Json = False,
) -> None:
    """How the blur is best normalised where a frame ends.

    Maps of a drive through generated apartments, with the blur of the place, against
    an unblurred map of all images: 1 - cosine of their cells, for cells that no pixel
    fell into (rim), that were seen up to three times (few), and more often. The whole
    window is what the authors and the mapper divide by.
    """
    with cli_errors("mapper"):
        from onemap_tools.bench.rim import RimBenchParams, run

        params = RimBenchParams(tuple(int(seed) for seed in seeds.split(",")), every)
        rows = []
        for row in run(params):
            rows.append(row)
            if not as_json:
                print("  ".join(f"{name} {value}" for name, value in row.items()))
    if as_json:
        print_json({"benchmark": "rim", "every": every, "rows": rows})
