"""Errors that end a command: one sentence for the user and an exit code."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

EXIT_OK, EXIT_FAILED, EXIT_USAGE_ERROR, EXIT_INTERRUPTED = 0, 1, 2, 130


class CliError(Exception):
    """Ends the command; the text says what happened and what to do about it.

    ``document``: keys that the JSON output holds beside ``error`` and ``exit_code``.
    """

    def __init__(
        self,
        sentence: str,
        exit_code: int = EXIT_FAILED,
        document: Mapping[str, Any] | None = None,
    ) -> None:
        super().__init__(sentence)
        self.exit_code = exit_code
        self.document = document or {}


def to_cli_error(error: BaseException) -> CliError:
    """The error that is reported to the user; other exceptions count as wrong usage."""
    if isinstance(error, CliError):
        return error
    if isinstance(error, KeyboardInterrupt):
        return CliError("Stopped.", EXIT_INTERRUPTED)
    return CliError(str(error), EXIT_USAGE_ERROR)


@contextmanager
def requires_extra(extra: str, subject: str) -> Iterator[None]:
    """Turn a missing package into a CliError that names the extra to install.

    ``subject``: what needs the package, at the start of the sentence.
    """
    try:
        yield
    except ModuleNotFoundError as missing:
        package = (missing.name or "").split(".")[0]
        if package.startswith("onemap_"):
            raise
        raise CliError(
            f"{subject} needs the package {package!r}: pip install -e '.[{extra}]'",
            EXIT_USAGE_ERROR,
        ) from missing
