"""``onemap bench storage``."""

from __future__ import annotations

from typing import Annotated

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.cli.options import Json
from onemap_tools.cli.terminal import print_json


def storage(
    *,
    hours: Annotated[float, typer.Option(min=0.01, help="Simulated.")] = 1.0,
    exchange: Annotated[
        float, typer.Option(min=1, help="Seconds after which each cell shows another thing.")
    ] = 600.0,
    noise: Annotated[
        float, typer.Option(min=0, help="Length of the noise of a view; that of a feature is 1.")
    ] = 0.5,
    seed: Annotated[int, typer.Option(min=0, help="Of features and noise.")] = 0,
    as_json: Json = False,
) -> None:
    """How far cells that are stored in float16 or float32 are from the exact belief.

    Cells of 768 channels see frames at 4 Hz in simulated time, and every cell shows
    another thing after a while. Each second they are compared with the same belief in
    float64: similarity_error_max is the greatest error of a cosine with what the cell
    shows or showed before, slowest_change_s how long it took until every cell was
    like the new thing. Cells that are rounded to the nearest are there to compare.
    """
    with cli_errors("mapper"):
        from onemap_tools.bench.storage import StorageOptions, run

        options = StorageOptions(hours=hours, exchange_s=exchange, noise=noise, seed=seed)
        result = run(options)
    if as_json:
        print_json(result)
    else:
        print("\n".join(f"{name:32} {value}" for name, value in result.items()))
