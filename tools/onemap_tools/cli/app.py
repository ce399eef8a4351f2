"""The ``onemap`` command. Commands import what they need when they run, so that it starts fast."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed_version
from typing import Annotated

import typer

from onemap_tools.bench.commands import PANEL as MEASURE_PANEL
from onemap_tools.bench.commands import app as bench_app
from onemap_tools.cli import ask, bag, certs, models, run, view
from onemap_tools.cli.command_group import CommandGroup
from onemap_tools.cli.config import app as config_app
from onemap_tools.cli.map import app as map_app
from onemap_tools.cli.ros2 import app as ros2_app
from onemap_tools.cli.scene import app as scene_app
from onemap_tools.cli.search_replay import app as search_replay_app
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


def version() -> str:
    """The version of the installed package, or that it is not installed."""
    try:
        return installed_version("onemap")
    except PackageNotFoundError:
        return "from sources that are not installed (pip install -e .)"


def _print_version(requested: bool) -> None:
    if requested:
        typer.echo(f"onemap {version()}")
        raise typer.Exit


@app.callback()
def root(
    _: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """A robot finds things that people name in plain words."""


app.add_typer(run.app)
app.add_typer(bag.app)
app.add_typer(bag.bag_app, name="bag", rich_help_panel=run.PANEL)
app.add_typer(view.app)
app.add_typer(view.export_app, name="export", rich_help_panel=run.PANEL)
app.add_typer(ask.app)
app.add_typer(search_replay_app)
app.add_typer(ros2_app)
app.add_typer(map_app, name="map", rich_help_panel=ask.PANEL)
app.add_typer(scene_app, name="scene", rich_help_panel=MEASURE_PANEL)
app.add_typer(config_app, name="config", rich_help_panel=run.PANEL)
app.add_typer(certs.app)
app.add_typer(bench_app, name="bench", rich_help_panel=MEASURE_PANEL)
app.add_typer(models.app, name="models", rich_help_panel=MEASURE_PANEL)
app.add_typer(models.export_app)
app.add_typer(train_app, name="train", rich_help_panel=MEASURE_PANEL)


def main() -> None:
    """Run the command line."""
    app()
