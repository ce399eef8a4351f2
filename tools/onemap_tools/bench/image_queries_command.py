"""``onemap bench image-queries``: pictures of things as queries."""

from __future__ import annotations

from typing import Annotated

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.cli.options import Config, Json
from onemap_tools.cli.terminal import print_json


def image_queries(
    *,
    seeds: Annotated[str, typer.Option(help="Of the apartments: 801-819 or 801,803")] = "800-807",
    pictures: Annotated[int, typer.Option(min=1, help="Images of each apartment.")] = 40,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """How often a crop of a thing leads to such a thing.

    Generated apartments are mapped in this process from images of sampled poses. Things
    that other images show are cut out along their true boxes and asked for. An answer is
    right if its best region lies within 1 m of a thing of the same category. Crops of
    things that an apartment does not have are asked for there, too: found is wrong then.
    """
    with cli_errors("demo"):
        import torch

        from onemap_perception.config import PerceptionConfig
        from onemap_shared.config import read, section
        from onemap_tools.bench import image_queries as bench
        from onemap_tools.bench.claims import parse_seeds

        torch.set_num_threads(1)
        encoder = section(read(config), "perception", PerceptionConfig).encoder
        chosen = parse_seeds(seeds)

        def report(done: int) -> None:
            typer.echo(f"{done} of {len(chosen)} apartments", err=True)

        result = bench.run(encoder, chosen, pictures, report)
    if as_json:
        print_json(result)
    else:
        print("\n".join(bench.table_lines(result)))
