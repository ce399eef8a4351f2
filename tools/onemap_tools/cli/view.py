"""Commands for viewers of others: Foxglove beside a running robot, Rerun from a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from onemap_tools.cli.options import Config, Json
from onemap_tools.errors import requires_extra

PANEL = "Run"
app = typer.Typer()
export_app = typer.Typer(no_args_is_help=True, help="Write a recording for another tool.")


@app.command(rich_help_panel=PANEL)
def live(
    config: Config = None,
    *,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="On 127.0.0.1; 0: any that is free.")
    ] = 8765,
    query: Annotated[
        str, typer.Option(help="Show the similarity to this; by default what a search looks for.")
    ] = "",
) -> None:
    """Serve map, camera, plans and numbers to Foxglove or Lichtblick, until Ctrl-C.

    Connect the viewer to ws://127.0.0.1:8765 and import the layout deploy/foxglove/onemap.json.
    Viewers look and change nothing but the query, a parameter. Costs nothing until one connects.
    """
    with requires_extra("live", "This command"):
        from onemap_tools.viewers.live import LiveOptions
        from onemap_tools.viewers.live import live as run
    from onemap_tools.cli.terminal import progress_console

    run(LiveOptions(config=config, port=port, query=query), progress_console())


@export_app.callback()
def export() -> None:
    """Write a recording for another tool."""


@export_app.command()
def rerun(
    file: Annotated[
        Path, typer.Argument(exists=True, dir_okay=False, help="A file of 'onemap record'.")
    ],
    out: Annotated[Path, typer.Argument(dir_okay=False, help="A new file, *.rrd.")],
    as_json: Json = False,
) -> None:
    """A recording as a file for Rerun: map, camera, plans, plots and log on a time line."""
    with requires_extra("rerun,record", "This command"):
        from onemap_tools.viewers.rerun_export import describe
        from onemap_tools.viewers.rerun_export import export as run
    from onemap_tools.cli.terminal import print_json, result_console

    document = run(file, out)
    result_console(as_json).print(*describe(document), sep="\n", soft_wrap=True)
    if as_json:
        print_json(document)
