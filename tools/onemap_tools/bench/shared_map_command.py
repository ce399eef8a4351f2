"""``onemap bench shared-map``: what a second robot gains from the map of the first."""

from __future__ import annotations

from typing import Annotated

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.bench.navigation.choices import Features, Method
from onemap_tools.cli.options import Config, Json
from onemap_tools.cli.terminal import print_json


def shared_map(
    *,
    seeds: Annotated[str, typer.Option(help="Of the apartments: 601-619 or 601,603")] = "2-8",
    features: Annotated[Features, typer.Option(help="Of the images.")] = Features.SIMULATED,
    limit: Annotated[float, typer.Option(min=1, help="Simulated seconds per object.")] = 300.0,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """What a robot's search gains from what another robot saw.

    In simulated time: in each apartment a first robot searches for two objects; then a second
    one, from another start, searches for an object of its own, once on an empty map and once on
    the map of the first, with a searched layer of its own. Its way and time are summed over the
    apartments in which both of its searches succeeded; the simulator's ground truth judges that.
    Their object may be one that the first robot found, passed, or never saw.

    Settings are chosen on even seeds, figures are of odd ones. An apartment takes a core 1 min.
    """
    with cli_errors("demo"):
        import torch

        from onemap_tools.bench import shared_map as bench
        from onemap_tools.bench.claims import parse_seeds, read_sections
        from onemap_tools.bench.navigation.episode_run import EpisodeSetup

        torch.set_num_threads(1)
        setups = (
            EpisodeSetup(
                index=index,
                config=read_sections(config, seed, "training"),
                method=Method.ONEMAP,
                features=features,
                objects=1,
                limit_s=limit,
            )
            for index, seed in enumerate(parse_seeds(seeds))
        )
        result = bench.run(setups, lambda row: typer.echo(bench.row_line(row), err=True))
    for name, value in result.items():
        if name != "rows":
            typer.echo(f"{name:20} {value}", err=as_json)
    if as_json:
        print_json(result)
