"""What every command does when it cannot go on: one sentence, an exit code, and JSON if asked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import typer
from typer.core import TyperGroup

from onemap_tools.errors import EXIT_INTERRUPTED, EXIT_USAGE_ERROR, CliError

# What click raises for a wrong command line. Typer names only a subclass of it, and whether
# click is a package of its own depends on typer's version.
UsageError = cast("type[typer.BadParameter]", typer.BadParameter.__base__)
JSON = "onemap.json"  # in the context: the command line asks for JSON


class CommandGroup(TyperGroup):
    """The root of a command line: what goes wrong below it is told here, never as a traceback.

    The sentence goes to stderr. With --json somewhere on the command line one JSON object with
    ``error`` and ``exit_code`` is the last line of stdout.
    """

    def make_context(
        self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any
    ) -> Any:
        """Parse the options of this group."""
        as_json = wants_json(args)
        try:
            context = super().make_context(info_name, args, parent, **extra)
        except UsageError as mistake:
            if parent is None:
                _print_usage_error(mistake, as_json)
            raise
        context.meta.setdefault(JSON, as_json)
        return context

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        from onemap_shared.config import ConfigError

        if ctx.parent is not None:  # the root tells it
            return super().invoke(ctx)
        try:
            return super().invoke(ctx)
        except UsageError as mistake:  # typer prints the sentence
            _print_usage_error(mistake, ctx.meta[JSON])
            raise
        except (CliError, ConfigError, KeyboardInterrupt) as problem:
            trouble = to_cli_error(problem)
            typer.echo(str(trouble), err=True)
            if ctx.meta[JSON]:
                _print_error(str(trouble), trouble.exit_code, trouble.document)
            raise typer.Exit(trouble.exit_code) from problem


def wants_json(arguments: Sequence[str]) -> bool:
    """Whether these words of a command line hold the option --json."""
    words = list(arguments)
    return "--json" in (words[: words.index("--")] if "--" in words else words)


def to_cli_error(problem: BaseException) -> CliError:
    """What the user is told of a problem that ends a command."""
    if isinstance(problem, CliError):
        return problem
    if isinstance(problem, KeyboardInterrupt):
        return CliError("Stopped.", EXIT_INTERRUPTED)
    return CliError(str(problem), EXIT_USAGE_ERROR)


def _print_usage_error(mistake: typer.BadParameter, as_json: bool) -> None:
    if as_json:
        _print_error(mistake.format_message(), EXIT_USAGE_ERROR, {})


def _print_error(sentence: str, exit_code: int, document: Mapping[str, Any]) -> None:
    from onemap_tools.cli.terminal import print_json

    print_json({**document, "error": sentence, "exit_code": exit_code})
