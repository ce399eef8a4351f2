"""The ``onemap`` command. Commands import what they need when they run, so that it starts fast."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from onemap_tools.bench.commands import app as bench_app
from onemap_tools.cli import ask, config, map, models, places, recordings, run
from onemap_tools.cli.command_group import CommandGroup
from onemap_tools.cli.options import DEEPER, FIRST, OPERATE, version
from onemap_tools.train.commands import app as train_app

NEWCOMERS = (
    "demo", "up", "query", "search", "go", "objects", "map", "status", "doctor", "record",
)  # fmt: skip
EPILOG = (
    "Start with 'onemap demo'.\n\n"
    "Exit codes: 0 yes or done; 1 no: not found, not ready, refused or failed; 2 misused: an "
    "option, a word or a configuration is wrong; 130 stopped by Ctrl-C before it was done. What "
    "runs until Ctrl-C, as 'up' or 'record', has done its work then: 0.\n\n"
    "With --json the last line on stdout is one JSON object; for an error it holds 'error', the "
    "sentence that is on stderr too, and 'exit_code'."
)


class RootGroup(CommandGroup):
    """All commands; the help shows first those that a newcomer needs."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Newcomers' commands in their order, then the others as they were added."""
        others = [name for name in super().list_commands(ctx) if name not in NEWCOMERS]
        return [*NEWCOMERS, *others]


app = typer.Typer(
    cls=RootGroup,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    epilog=EPILOG,
)


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


for commands in (ask.app, places.app, recordings.app, run.app):
    app.add_typer(commands)
for name, group, panel in (
    ("map", map.app, FIRST),
    ("service", run.service_app, OPERATE),
    ("config", config.app, OPERATE),
    ("models", models.app, DEEPER),
    ("bench", bench_app, DEEPER),
    ("train", train_app, DEEPER),
):
    app.add_typer(group, name=name, rich_help_panel=panel)


def main() -> None:
    """Run the command line."""
    app()
