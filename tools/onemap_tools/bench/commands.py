"""``onemap bench``: from options to a printed result, in one way for all benchmarks."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import typer

from onemap_tools.bench.options import BENCHMARKS, Options
from onemap_tools.cli.terminal import print_json
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError, requires_extra


def measure(options: Options) -> None:
    """Run a benchmark and print its result."""
    try:
        with requires_extra(options.extra, "This benchmark"):
            bench = import_module(f"onemap_tools.bench.{options.module}")
            result = bench.run(options, lambda line: typer.echo(line, err=True))
    except ValueError as problem:
        raise CliError(str(problem), EXIT_USAGE_ERROR) from problem
    lines = getattr(bench, "lines", result_lines)(result)
    typer.echo("\n".join(lines), err=options.as_json)
    if options.as_json:
        print_json(result)


def result_lines(result: dict[str, Any]) -> list[str]:
    """One line per value."""
    return [f"{name:26} {value}" for name, value in result.items()]


# A command is a class of options: made from the command line, it goes to ``measure``.
app = typer.Typer(no_args_is_help=True, help="Measure on this machine.", result_callback=measure)
for benchmark in BENCHMARKS:
    app.command(benchmark.__name__.removesuffix("Bench").lower())(benchmark)
