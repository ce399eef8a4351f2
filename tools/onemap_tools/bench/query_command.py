"""``onemap bench query``."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.cli.options import Json
from onemap_tools.cli.terminal import print_json

app = typer.Typer()


class FeatureDtype(str, Enum):
    """How features are stored."""

    FLOAT32 = "float32"
    FLOAT16 = "float16"


@app.command()
def query(
    *,
    cells: Annotated[int, typer.Option(min=4096, help="Of the map.")] = 250_000,
    feature_dtype: Annotated[
        FeatureDtype, typer.Option(help="As mapper.feature_dtype.")
    ] = FeatureDtype.FLOAT32,
    device: Annotated[str, typer.Option(help="cpu, cuda or cuda:N, as mapper.device.")] = "cpu",
    threads: Annotated[int, typer.Option(min=1, help="CPU threads of torch.")] = 1,
    seed: Annotated[int, typer.Option(min=0, help="Of the features.")] = 0,
    wait_frames: Annotated[
        int, typer.Option(min=0, help="Fused at 8 Hz while new texts are asked; 0: none.")
    ] = 40,
    as_json: Json = False,
) -> None:
    """How long a text query over a large map takes, inside the mapper.

    Random features of 768 channels. read_ms is reading the table once, and
    matrix_product_ms what the machine's own rate for large matrices would take for
    32 texts, both measured in this run. product_ms: the scalar products of one text
    alone, where the features are. A plain text has no calibration; a
    calibrated one competes with 103 neutral words, whose part is computed with the
    first text (first_calibrated_text_ms) and kept. standing_ms_per_frame: 20 texts
    asked again after a frame changed 800 cells. Processor time with one thread,
    the best of several runs. With --device cuda the features are on the GPU, and
    the times are of the clock, read when the GPU is done.

    frame_waits: how long frames of 800 cells wait for the map's lock while new texts
    are asked without a pause, in ms of the clock, and the longest that a query held
    it, in ms of processor time; with_a_held_lock: the same if a query held the lock
    until it had its answer.
    """
    with cli_errors("mapper"):
        from onemap_tools.bench.query_time import QueryTimeOptions, run
        from onemap_tools.bench.query_waits import Dtype

        dtype: Dtype = "float16" if feature_dtype is FeatureDtype.FLOAT16 else "float32"
        result = run(QueryTimeOptions(cells, dtype, threads, seed, wait_frames, device))
    if as_json:
        print_json(result)
    else:
        print("\n".join(f"{name:26} {value}" for name, value in result.items()))
