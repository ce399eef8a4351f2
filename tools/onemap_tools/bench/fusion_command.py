"""``onemap bench fusion``."""

from __future__ import annotations

from typing import Annotated

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.cli.options import Json
from onemap_tools.cli.terminal import print_json

app = typer.Typer()


@app.command()
def fusion(
    *,
    frames: Annotated[int, typer.Option(min=1, help="Frames to measure.")] = 50,
    device: Annotated[str, typer.Option(help="cpu, cuda or cuda:N, as mapper.device.")] = "cpu",
    threads: Annotated[int, typer.Option(min=1, help="CPU threads of torch.")] = 1,
    blur: Annotated[int, typer.Option(min=0, max=10, help="Cells to each side; 0: none.")] = 3,
    compiled: Annotated[bool, typer.Option(help="As mapper.compiled.")] = True,
    seed: Annotated[int, typer.Option(min=0, help="Of the features.")] = 0,
    as_json: Json = False,
) -> None:
    """How long the map takes to fuse one frame.

    Timed per frame: projection, blur, fusion and occupancy of a 640 x 480 field
    with 24 x 24 x 768 features. The variance is perception's work and the
    decoding the bus's; both are done beforehand. The room is simulated, the
    features are random. cpu_p50_ms and cpu_min_ms are the processor time of a
    frame, which other processes disturb less. With --device cuda the frame is
    computed on the GPU; all other times are of the clock, read when the GPU is done.

    parts_ms are the best times of the parts. moved_bytes and operations are what a
    frame needs at least, copy_gb_s and matrix_gflops what this machine does, both
    measured in this run, least_ms the longer of both times.
    """
    with cli_errors("mapper"):
        from onemap_tools.bench.fusion import FusionBenchOptions, run

        options = FusionBenchOptions(
            frames=frames,
            device=device,
            threads=threads,
            half_width=blur,
            compiled=compiled,
            seed=seed,
        )
        result = run(options)
    if as_json:
        print_json(result)
    else:
        print("\n".join(f"{name:20} {value}" for name, value in result.items()))
