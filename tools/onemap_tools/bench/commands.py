"""``onemap bench``: measure on this machine. Each benchmark reads its own options."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import typer

from onemap_tools.errors import EXIT_USAGE_ERROR, CliError

PANEL = "Look deeper"
app = typer.Typer(no_args_is_help=True, help="Measure on this machine.")
PASS_OPTIONS = {"allow_extra_args": True, "ignore_unknown_options": True}


@app.command(context_settings=PASS_OPTIONS, add_help_option=False)
def fusion(ctx: typer.Context) -> None:
    """How long the map takes to fuse one frame."""
    with _cli_errors("mapper"):
        from onemap_tools.bench.fusion import main

        raise typer.Exit(main(ctx.args))


@app.command(context_settings=PASS_OPTIONS, add_help_option=False)
def perception(ctx: typer.Context) -> None:
    """How long an encoder takes for one frame, on CPU and GPU."""
    with _cli_errors("openclip"):
        from onemap_tools.bench.perception import main

        raise typer.Exit(main(ctx.args))


@app.command(context_settings=PASS_OPTIONS, add_help_option=False)
def claims(ctx: typer.Context) -> None:
    """What simulated searches claim to have found, and what really stands there."""
    with _cli_errors("demo"):
        from onemap_tools.bench.claims import main

        raise typer.Exit(main(ctx.args))


@app.command(context_settings=PASS_OPTIONS, add_help_option=False)
def queries(ctx: typer.Context) -> None:
    """Which scores mean something: the floor of an encoder and how often it errs."""
    with _cli_errors("demo"):
        from onemap_tools.bench.queries import main

        raise typer.Exit(main(ctx.args))


@contextmanager
def _cli_errors(extra: str) -> Iterator[None]:
    try:
        yield
    except ModuleNotFoundError as missing:
        raise CliError(
            f"This benchmark needs the package {missing.name!r}: pip install 'onemap[{extra}]'",
            EXIT_USAGE_ERROR,
        ) from missing
    except ValueError as problem:
        raise CliError(str(problem), EXIT_USAGE_ERROR) from problem
