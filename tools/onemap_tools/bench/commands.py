"""``onemap bench``: from options to a printed result, in one way for all benchmarks."""

from __future__ import annotations

import dataclasses
import inspect
from importlib import import_module
from typing import Any, get_type_hints

import typer

from onemap_tools.bench.options import BENCHMARKS, Options
from onemap_tools.cli.options import Json
from onemap_tools.cli.terminal import print_json
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, EXIT_USAGE_ERROR, CliError, requires_extra

PANEL = "Look deeper"
app = typer.Typer(no_args_is_help=True, help="Measure on this machine.")


def measure(options: Options, as_json: bool) -> int:
    """Run a benchmark and print its result; the exit code says whether all could be measured."""
    try:
        with requires_extra(options.extra, "This benchmark"):
            bench = import_module(f"onemap_tools.bench.{options.module}")
            result = bench.run(options, lambda line: typer.echo(line, err=True))
    except ValueError as problem:
        raise CliError(str(problem), EXIT_USAGE_ERROR) from problem
    lines = getattr(bench, "lines", result_lines)(result)
    typer.echo("\n".join(lines), err=as_json)
    if as_json:
        print_json(result)
    return EXIT_FAILED if any("problem" in row for row in rows_of(result)) else EXIT_OK


def rows_of(result: dict[str, Any]) -> list[dict[str, Any]]:
    """What was measured one after the other, if it was."""
    return list(result.get("results", ()))


def result_lines(result: dict[str, Any]) -> list[str]:
    """One line per row, or per value of a result without rows."""
    if rows := rows_of(result):
        return ["  ".join(f"{name} {value}" for name, value in row.items()) for row in rows]
    return [f"{name:26} {value}" for name, value in result.items()]


def add_command(options: type[Options]) -> None:
    """Add the command of a benchmark: its options are the fields."""
    hints = {**get_type_hints(options, include_extras=True), "as_json": Json}
    defaults = {
        field.name: inspect.Parameter.empty
        if field.default is dataclasses.MISSING
        else field.default
        for field in dataclasses.fields(options)
    }

    def command(*, as_json: bool, **values: Any) -> None:
        raise typer.Exit(measure(options(**values), as_json))

    command.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [
            inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hints[name]
            )
            for name, default in {**defaults, "as_json": False}.items()
        ]
    )
    command.__annotations__ = {name: hints[name] for name in (*defaults, "as_json")}
    name = options.__name__.removesuffix("Bench").lower()
    app.command(name, help=inspect.getdoc(options))(command)


for benchmark in BENCHMARKS:
    add_command(benchmark)
