"""Commands for recordings: record, and play what was recorded."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from onemap_tools.cli.options import FIRST, RECORDINGS, Config, Json, version
from onemap_tools.cli.terminal import print_json, progress_console, result_console
from onemap_tools.errors import requires_extra

app = typer.Typer()


@app.command(rich_help_panel=FIRST)
def record(
    out: Annotated[
        Path | None,
        typer.Argument(dir_okay=False, help="A new MCAP file; by default in runs/recordings."),
    ] = None,
    *,
    config: Config = None,
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
    with requires_extra("record", "This command"):
        from onemap_tools.recording import record as command

    path = out or Path("runs/recordings") / f"{datetime.now():%Y%m%d-%H%M%S}.mcap"
    options = command.RecordOptions(path, config, images, seconds, keep_free, version=version())
    document = command.record(options, progress_console())
    for key, count in document["missed"].items():
        progress_console().print(f"{count} messages on {key} are missing in it.")
    _show(
        document,
        lambda done: [f"Recorded {done['seconds']:.0f} s, {done['bytes'] / 1e6:.1f} MB."],
        as_json,
    )


def _show(
    document: dict[str, Any], describe: Callable[[dict[str, Any]], list[str]], as_json: bool
) -> None:
    result_console(as_json).print(*describe(document), sep="\n", soft_wrap=True)
    if as_json:
        print_json(document)


@app.command(rich_help_panel=RECORDINGS)
def replay(
    path: Annotated[
        Path | None,
        typer.Argument(
            exists=True,
            help="A folder with frames.json and PNG files, or an MCAP file of 'onemap record'.",
        ),
    ] = None,
    config: Config = None,
    *,
    reencode: Annotated[
        bool,
        typer.Option("--reencode", help="From the images, with the encoder of --config."),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            dir_okay=False,
            help="Write the map here (*.npz); 'onemap map load' takes it from mapper.map_folder.",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """A recording: a folder in place of a robot, or the map of a file once more.

    A folder is published like a robot until Ctrl-C. Of an MCAP file the map of all recorded
    features is computed, in this process alone, with the settings of --config. Exit code 2 if the
    file cannot be read.
    """
    if path is not None and not path.is_dir():
        with requires_extra("record,mapper,perception", "The replay of a file"):
            from onemap_tools.recording import replay as command

        document = command.replay(command.ReplayOptions(path, config, reencode, out))
        _show(document, command.describe, as_json)
        return
    if path is not None:
        os.environ["ONEMAP__REPLAY__DIRECTORY"] = json.dumps(str(path))
    from onemap_tools.processes.services import run

    run("replay", config)
