"""``onemap bench habitat``: the paper's tables, for whoever holds the data."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from onemap_tools.bench.habitat.choices import SuccessRule
from onemap_tools.bench.navigation.choices import Method
from onemap_tools.bench.options import MethodOption
from onemap_tools.cli.options import Config, Json
from onemap_tools.cli.terminal import print_json
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError, requires_extra

app = typer.Typer()


@app.command()
def habitat(
    *,
    episodes: Annotated[
        Path, typer.Option(help="Split of ObjectNav, or the paper's folder of multi-object ones.")
    ],
    scenes: Annotated[Path, typer.Option(help="Folder in which hm3d or hm3d_v0.2 lies.")],
    out: Annotated[Path, typer.Option(help="Folder of the results; a killed run goes on there.")],
    goals: Annotated[
        Path | None, typer.Option(help="ObjectNav of the same scenes, for multi-object episodes.")
    ] = None,
    count: Annotated[int | None, typer.Option(min=1, help="Only the first; default: all.")] = None,
    method: MethodOption = Method.ONEMAP,
    success: Annotated[
        SuccessRule, typer.Option(help="1.5 m from a box (paper), 0.1 m from a view point.")
    ] = SuccessRule.PAPER,
    limit: Annotated[float, typer.Option(min=1, help="Simulated seconds per object.")] = 300.0,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """The paper's tables on HM3D, in Habitat: SR, SPL, PR, PPL, SPL by position.

    Needs Habitat-Sim and the HM3D scenes with their annotations; docs/benchmarks.md
    says what to install. Searches in simulated time; the folder holds tables.md,
    results.json, a page and one line per episode. It has never been run on the real
    data: its tests drive a stand-in for Habitat.
    """
    with requires_extra("demo", "This benchmark"):
        from onemap_tools.bench.habitat import benchmark
        from onemap_tools.bench.habitat.tables import paper_tables
        from onemap_tools.bench.navigation.report import episode_line

        options = benchmark.HabitatOptions(
            episodes, scenes, goals, count, method, success, limit, config
        )
        try:
            result = benchmark.run_habitat(
                options,
                out=out,
                report=lambda record: typer.echo(episode_line(record), err=True),
            )
        except ValueError as problem:
            raise CliError(str(problem), EXIT_USAGE_ERROR) from problem
    typer.echo(paper_tables(result), err=as_json)
    if as_json:
        print_json(result)
