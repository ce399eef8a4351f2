"""``onemap bench foreign``: an encoder in apartments that no training has seen anything like."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.cli.options import Config, Json
from onemap_tools.cli.terminal import print_json

Furnishings = Annotated[
    int, typer.Option(min=1, max=20, help="Of each apartment; 3 show every shape.")
]
BesideFolder = Annotated[
    Path | None,
    typer.Option(
        file_okay=False,
        help="Also measure the model card's two sets; their pictures are kept in this folder.",
    ),
]
PicturesFolder = Annotated[
    Path | None,
    typer.Option(file_okay=False, help="Write pictures to look at: every shape, every room."),
]
app = typer.Typer()


@app.command()
def foreign(
    *,
    furnishings: Furnishings = 3,
    pictures: Annotated[int, typer.Option(min=2, max=1000, help="Of each furnishing.")] = 30,
    beside: BesideFolder = None,
    out: PicturesFolder = None,
    processes: Annotated[int, typer.Option(min=1, max=64, help="Processes that render.")] = 1,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """How well an encoder knows a stranger's rooms: the foreign test set.

    Three apartments with furniture, textures, light and a renderer of their own, of
    which no training has seen anything; three classes have no word in mini's
    vocabulary. Every picture is labelled by the geometry. mIoU takes the best of the
    words of mini's vocabulary for each pixel; AUROC and R-precision are those of the
    model card. The calibration error of the best answer compares the score of each
    patch's best word with how often it is right. Nothing is random: the same command
    gives the same figures.

    The figures are for reporting: no training and no setting may be chosen by them.
    """
    with cli_errors("train"):
        import torch

        from onemap_perception.config import PerceptionConfig
        from onemap_shared.config import read, section
        from onemap_tools.bench import foreign as bench
        from onemap_tools.bench.foreign_report import table_lines
        from onemap_tools.foreign.contact_sheet import write_pictures
        from onemap_tools.foreign.frames import ForeignSetSpec

        torch.set_num_threads(1)
        params = bench.ForeignBenchParams(ForeignSetSpec(furnishings, pictures), beside, processes)

        def report(what: str, done: int, total: int) -> None:
            if done % 30 == 0 or done == total or total < 30:
                typer.echo(f"{what}: {done} of {total}", err=True)

        if out is not None:
            write_pictures(out, lambda name: typer.echo(f"drew {name}", err=True))
        perception = section(read(config), "perception", PerceptionConfig)
        result = bench.run(perception.encoder, params, report)
    typer.echo("\n".join(table_lines(result)), err=as_json)
    if as_json:
        print_json(result)
