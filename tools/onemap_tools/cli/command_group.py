"""Error handling of the whole command line: one sentence, an exit code, and JSON if asked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import typer
from typer.core import TyperGroup

from onemap_tools.errors import EXIT_USAGE_ERROR, CliError, to_cli_error

# What click raises for a wrong command line. Typer names only a subclass of it, and whether
# click is a package of its own depends on typer's version.
UsageError = cast("type[typer.BadParameter]", typer.BadParameter.__base__)
JSON = "onemap.json"  # key of the click context: whether --json was given


class CommandGroup(TyperGroup):
    """Root command group: reports every error of the commands below it without a traceback.

    The sentence goes to stderr. With --json anywhere on the command line one JSON object with
    ``error`` and ``exit_code`` is the last line of stdout.
    """

    def make_context(
        self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any
    ) -> Any:
        """Parse the options of this group."""
        as_json = wants_json(args)
        try:
            context = super().make_context(info_name, args, parent, **extra)
        except UsageError as error:
            if parent is None and as_json:
                _print_error(error.format_message(), EXIT_USAGE_ERROR, {})
            raise
        context.meta.setdefault(JSON, as_json)
        return context

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command of the first word, or of the first two: 'search replay' beside 'search'."""
        two = " ".join(args[:2])
        return super().resolve_command(ctx, [two, *args[2:]] if two in self.commands else args)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command; its help ends with those below it, as 'search list' below 'search'."""
        command = super().get_command(ctx, cmd_name)
        if command is not None and not command.epilog:
            command.epilog = "\n\n".join(self._below(cmd_name))
        return command

    def _below(self, name: str) -> list[str]:
        """The commands whose first word this is, each with what it does."""
        below = (each for each in self.commands if each.startswith(f"{name} "))
        return [
            f"onemap {each}: {self.commands[each].get_short_help_str(limit=100)}" for each in below
        ]

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        from onemap_shared.config import ConfigError

        as_json = ctx.meta[JSON] and ctx.parent is None  # the root reports
        try:
            return super().invoke(ctx)
        except UsageError as error:  # typer prints the sentence
            if as_json:
                _print_error(error.format_message(), EXIT_USAGE_ERROR, {})
            raise
        except (CliError, ConfigError, KeyboardInterrupt) as cause:
            if ctx.parent is not None:
                raise
            reported = to_cli_error(cause)
            typer.echo(str(reported), err=True)
            if as_json:
                _print_error(str(reported), reported.exit_code, reported.document)
            raise typer.Exit(reported.exit_code) from cause


def wants_json(arguments: Sequence[str]) -> bool:
    """Whether the command line holds the option --json; what follows ``--`` is no option."""
    words = list(arguments)
    return "--json" in (words[: words.index("--")] if "--" in words else words)


def _print_error(sentence: str, exit_code: int, document: Mapping[str, Any]) -> None:
    from onemap_tools.cli.terminal import print_json

    print_json({**document, "error": sentence, "exit_code": exit_code})
