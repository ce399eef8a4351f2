"""``onemap bench verdicts``: how often found, not here and not looked yet are right."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.cli.options import Config, Json
from onemap_tools.cli.terminal import print_json

FinishedFile = Annotated[
    Path | None,
    typer.Option(dir_okay=False, help="File of finished apartments; a killed run goes on."),
]
Plot = Annotated[
    Path | None, typer.Option(dir_okay=False, help="Write the reliability plot, a PNG.")
]


def verdicts(
    *,
    seeds: Annotated[str, typer.Option(help="Of the apartments: 900-919 or 900,901")] = "900-919",
    out: FinishedFile = None,
    plot: Plot = None,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """How often the map is right with found, not here, and not looked yet.

    In each generated apartment a camera drives along the floor until it has seen all
    of it. After 6, 20, 40, 70 and 100 % of its images the map is asked for the name of
    every class of mini, and for words that name nothing in any apartment.

    Found is right if the best region lies within 1 m of such an object; not here, if
    there is none and no part of the reachable floor larger than 2 m2 was hidden;
    not looked yet, if none was shown well and more than 0.5 m2 was hidden, or the one
    that is there was not shown well.

    Even seeds choose found_score and looked_share; the rates, of the configured
    ones, are measured on odd seeds. An apartment takes a core 20 s.
    """
    with cli_errors("train" if plot else "demo"):
        import torch

        from onemap_mapper.config import MapperConfig
        from onemap_perception.config import PerceptionConfig
        from onemap_shared.config import read, section
        from onemap_tools.bench import verdict_report
        from onemap_tools.bench import verdicts as bench
        from onemap_tools.bench.claims import parse_seeds

        torch.set_num_threads(1)
        sections = read(config)
        mapper = section(sections, "mapper", MapperConfig)
        outcomes = bench.run(
            section(sections, "perception", PerceptionConfig).encoder,
            bench.VerdictBenchParams(tuple(parse_seeds(seeds)), "training", out),
            lambda line: typer.echo(line, err=True),
        )
        result = verdict_report.summarise(outcomes, (mapper.found_score, mapper.looked_share))
        if plot is not None:
            verdict_report.draw_reliability(result, plot)
    typer.echo("\n".join(verdict_report.table_lines(result)), err=as_json)
    if as_json:
        print_json(result)
