"""Commands for recordings: record what travels on the bus, look at a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from onemap_tools.cli.options import Config, Json
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, EXIT_USAGE_ERROR, CliError, requires_extra

PANEL = "Run"
EXTRA = "record"
app = typer.Typer()
bag_app = typer.Typer(no_args_is_help=True, help="Look at a recording.")


@app.command(rich_help_panel=PANEL)
def record(
    out: Annotated[
        Path | None,
        typer.Argument(dir_okay=False, help="A new MCAP file; by default in runs/recordings."),
    ] = None,
    *,
    config: Config = None,
    clear_map: Annotated[
        bool,
        typer.Option(
            "--clear-map", help="Clear the map first, so that a replay begins where it begins."
        ),
    ] = False,
    images: Annotated[
        bool, typer.Option(help="Also the images; a map is rebuilt from the features alone.")
    ] = True,
    seconds: Annotated[
        float | None, typer.Option(min=1, help="End after so long; by default at Ctrl-C.")
    ] = None,
    keep_free: Annotated[
        int, typer.Option(min=0, help="MB; end before the disk has less, so that others can write.")
    ] = 1000,
    as_json: Json = False,
) -> None:
    """Record a running robot: images, poses, features, detections, commands, searches, map.

    A recorder that is killed leaves a file that can be read, without its last second. It ends by
    itself, with exit code 1, when the disk is full; the robot goes on.
    """
    with requires_extra(EXTRA, "This command"):
        from onemap_tools.bag.record import RecordOptions
        from onemap_tools.bag.record import record as run
    from onemap_tools.cli.app import version
    from onemap_tools.cli.terminal import progress_console

    options = RecordOptions(
        path=out or _new_file(),
        config=config,
        images=images,
        clear_map=clear_map,
        seconds=seconds,
        keep_free_mb=keep_free,
        version=version(),
    )
    _report(run(options, progress_console()), as_json)


def _report(document: dict[str, Any], as_json: bool) -> None:
    """Say what was recorded, and what is missing in it."""
    from onemap_tools.cli.terminal import print_json, progress_console, result_console

    result_console(as_json).print(
        f"Recorded {document['seconds']:.0f} s, {document['bytes'] / 1e6:.1f} MB.", soft_wrap=True
    )
    for key, count in document["missed"].items():
        progress_console().print(f"{count} messages on {key} are missing in it.")
    if as_json:
        print_json(document)


@bag_app.callback()
def bag() -> None:
    """Look at a recording."""


@bag_app.command(name="info")
def bag_info(
    file: Annotated[
        Path, typer.Argument(exists=True, dir_okay=False, help="An MCAP file, also of ROS 2.")
    ],
    as_json: Json = False,
) -> None:
    """What a recording holds; reads all of it and checks its checksums.

    Exit code 0 if it is complete, 1 if it was cut off, 2 if it is damaged or no MCAP file.
    """
    with requires_extra(EXTRA, "This command"):
        from onemap_tools.bag.bag_file import BagError
        from onemap_tools.bag.bag_info import describe, info
    from onemap_tools.cli.terminal import print_json, result_console

    try:
        document = info(file)
    except BagError as problem:
        sentence = str(problem)
        raise CliError(f"{sentence[0].upper()}{sentence[1:]}.", EXIT_USAGE_ERROR) from problem
    result_console(as_json).print(*describe(document), sep="\n", soft_wrap=True)
    if as_json:
        print_json(document)
    raise typer.Exit(EXIT_FAILED if document["cut_off"] else EXIT_OK)


def _new_file() -> Path:
    from datetime import datetime

    return Path("runs/recordings") / f"{datetime.now():%Y%m%d-%H%M%S}.mcap"
