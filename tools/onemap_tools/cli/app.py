"""The ``onemap`` command: thin, so that it starts at once; work is imported when asked for."""

from __future__ import annotations

import json
import os
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from onemap_tools.bench import commands
from onemap_tools.cli import ask, config, map, models, scene
from onemap_tools.cli.command_group import CommandGroup
from onemap_tools.cli.options import Config, Json
from onemap_tools.errors import EXIT_FAILED, EXIT_OK
from onemap_tools.train.commands import app as train_app

EPILOG = (
    "Start with 'onemap demo'.\n\n"
    "Exit codes: 0 yes or done; 1 no: not found, not ready, refused or failed; 2 misused: an "
    "option, a word or a configuration is wrong; 130 stopped by Ctrl-C.\n\n"
    "With --json the last line on stdout is one JSON object; for an error it holds 'error', the "
    "sentence that is on stderr too, and 'exit_code'."
)
app = typer.Typer(
    cls=CommandGroup,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    epilog=EPILOG,
)
PANEL = "Run"
SCENE_HELP = (
    "A GLB, glTF, OBJ or PLY file instead. A YAML file beside it with the same name corrects it: "
    "categories (node: name), start (x, y, yaw), up (y or z). See 'onemap scene check'."
)


def _print_version(asked: bool) -> None:
    if asked:
        from onemap_tools.cli.version import version

        typer.echo(f"onemap {version()}")
        raise typer.Exit


@app.callback()
def root(
    _: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Say it and end."),
    ] = False,
) -> None:
    """A robot finds things that people name in plain words."""


@app.command(rich_help_panel=PANEL)
def demo(
    *,
    seed: Annotated[int, typer.Option(min=0, help="Which made-up apartment.")] = 1,
    scene: Annotated[
        Path | None,
        typer.Option(exists=True, dir_okay=False, help=SCENE_HELP),
    ] = None,
    objects: Annotated[
        str | None,
        typer.Option(help="What to find, separated by commas; by default what is there."),
    ] = None,
    headless: Annotated[bool, typer.Option(help="End after the search.")] = False,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Of the live page; 0: 8080, headless any.")
    ] = 0,
    out: Annotated[
        Path, typer.Option(file_okay=False, help="Where the folder of the run is made.")
    ] = Path("runs"),
    time_limit: Annotated[
        float, typer.Option(min=1, help="Seconds; then the search is cancelled.")
    ] = 360.0,
    as_json: Json = False,
) -> None:
    """Everything on this machine: a simulated robot searches for three objects.

    Exit code 0 only if all were found and the simulator confirms it. It cannot for what a
    scene file does not name: there the robot's own word counts. See 'onemap scene check'.
    """
    from onemap_tools.cli.terminal import print_json, progress_console, stays_up
    from onemap_tools.demo import run as command
    from onemap_tools.demo.setup import DemoOptions, choose_port, parse_objects, run_folder

    console = progress_console()
    stay = stays_up(headless)
    options = DemoOptions(
        seed=seed,
        scene=scene,
        objects=parse_objects(objects),
        headless=not stay,
        port=choose_port(port, headless=not stay, console=console),
        folder=run_folder(out, datetime.now(), seed),
        time_limit_s=time_limit,
    )
    document = command.run_with_report(options, console)
    if as_json:
        print_json(document)
    raise typer.Exit(EXIT_OK if document["worked"] else EXIT_FAILED)


@app.command(rich_help_panel=PANEL)
def up(
    config: Config = None,
    only: Annotated[
        str, typer.Option(help="Start only these, separated by commas: router, mapper, ...")
    ] = "",
    logs: Annotated[Path, typer.Option(file_okay=False, help="Folder for the logs.")] = Path(
        "runs/up"
    ),
) -> None:
    """All services on this machine until Ctrl-C; what crashes is started again.

    The robot is the one that the configuration has a section for: simulator or replay.
    A router is started if the configuration expects one here and none answers. Nothing is
    started where somebody runs the same already, or where the page's port is taken.
    """
    from onemap_tools.cli.terminal import progress_console
    from onemap_tools.processes import up as command

    names = [name for part in only.split(",") if (name := part.strip())]
    command.up(config, names, logs, progress_console())


@app.command(rich_help_panel=PANEL)
def router(
    config: Config = None,
    listen: Annotated[
        list[str] | None, typer.Option(help="Endpoint to listen on, e.g. tcp/0.0.0.0:7447.")
    ] = None,
    zenoh_config: Annotated[
        Path | None, typer.Option(help="A JSON5 file as zenohd reads it.")
    ] = None,
) -> None:
    """The Zenoh router that the services meet at."""
    from onemap_tools.processes import router as command

    command.run(config, listen or (), zenoh_config)


def _serve(name: str, config: Path | None) -> None:
    from onemap_tools.processes.services import run

    raise typer.Exit(run(name, ("--config", str(config)) if config is not None else ()))


@app.command(rich_help_panel=PANEL)
def simulator(config: Config = None) -> None:
    """A robot in a made-up apartment."""
    _serve("simulator", config)


@app.command(rich_help_panel=PANEL)
def replay(
    directory: Annotated[
        Path | None,
        typer.Argument(exists=True, file_okay=False, help="Holds frames.json and its PNG files."),
    ] = None,
    config: Config = None,
) -> None:
    """A recording in place of a robot."""
    if directory is not None:
        os.environ["ONEMAP__REPLAY__DIRECTORY"] = json.dumps(str(directory))
    _serve("replay", config)


@app.command(rich_help_panel=PANEL)
def perception(config: Config = None) -> None:
    """Images to language-aligned features."""
    _serve("perception", config)


@app.command(rich_help_panel=PANEL)
def mapper(config: Config = None) -> None:
    """Features to a map that answers text."""
    _serve("mapper", config)


@app.command(rich_help_panel=PANEL)
def planner(config: Config = None) -> None:
    """Where to look next, and driving there."""
    _serve("planner", config)


@app.command(rich_help_panel=PANEL)
def gateway(config: Config = None) -> None:
    """The HTTP API and the live page."""
    _serve("gateway", config)


app.add_typer(ask.app)
app.add_typer(map.app, name="map", rich_help_panel=ask.PANEL)
app.add_typer(scene.app, name="scene", rich_help_panel=commands.PANEL)
app.add_typer(config.app, name="config", rich_help_panel=PANEL)
app.add_typer(commands.app, name="bench", rich_help_panel=commands.PANEL)
app.add_typer(models.app, name="models", rich_help_panel=commands.PANEL)
app.command(name="export-encoder", rich_help_panel=commands.PANEL)(models.export_encoder)
app.add_typer(train_app, name="train", rich_help_panel=commands.PANEL)


def main() -> None:
    """Run the command line."""
    app()
