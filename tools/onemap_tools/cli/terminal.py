"""Where output goes: progress to stderr, results to stdout, JSON as stdout's last line."""

from __future__ import annotations

import json
import sys
from typing import IO, Any

from rich.console import Console


def plain_console(*, stderr: bool = False, file: IO[str] | None = None) -> Console:
    """Prints strings as they are: what users and robots name is no markup and no emoji.

    Styles are given by ``Text`` and ``style=``. All consoles are made here.
    """
    return Console(stderr=stderr, file=file, markup=False, emoji=False, highlight=False)


def progress_console() -> Console:
    """For what is going on."""
    return plain_console(stderr=True)


def result_console(as_json: bool) -> Console:
    """For what came out of it; beside a JSON result the prose goes to stderr."""
    return plain_console(stderr=as_json)


def stays_up(headless: bool) -> bool:
    """Whether a person watches: a demo in a script ends after the search."""
    return not headless and sys.stdout.isatty()


def print_json(document: dict[str, Any]) -> None:
    """Print one JSON object as a line of its own."""
    print(json.dumps(document, separators=(", ", ": "), allow_nan=False), flush=True)
