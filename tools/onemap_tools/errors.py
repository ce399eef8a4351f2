"""What goes wrong for a person at the command line, told in one sentence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

EXIT_OK, EXIT_FAILED, EXIT_USAGE_ERROR, EXIT_INTERRUPTED = 0, 1, 2, 130


class CliError(Exception):
    """The command cannot go on; the text says what happened and what to do about it.

    ``document``: what else a program is told beside the error, if it asked for JSON.
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
