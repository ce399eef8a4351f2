"""Consoles: progress goes to stderr, results to stdout, JSON is the last line of stdout."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from typing import IO, TYPE_CHECKING, Any, TypeVar

from rich.console import Console

if TYPE_CHECKING:
    from onemap import Client

R = TypeVar("R")


def plain_console(*, stderr: bool = False, file: IO[str] | None = None) -> Console:
    """A console that prints strings literally: names of users and robots are never markup.

    Styles are set by ``Text`` and ``style=``. All consoles are created here.
    """
    return Console(stderr=stderr, file=file, markup=False, emoji=False, highlight=False)


def progress_console() -> Console:
    """The console for progress: stderr."""
    return plain_console(stderr=True)


def result_console(as_json: bool) -> Console:
    """The console for results: stdout, or stderr if stdout holds JSON."""
    return plain_console(stderr=as_json)


def stays_up(headless: bool | None) -> bool:
    """Whether the demo keeps running after the search; if not said, only on a terminal."""
    return sys.stdout.isatty() if headless is None else not headless


def confirmed(question: str) -> bool | None:
    """Whether the user types y or yes on a terminal; None without one, where nobody is asked."""
    if not sys.stdin.isatty():
        return None
    print(f"{question} [y/N] ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def print_json(document: dict[str, Any]) -> None:
    """Print one JSON object as a line of its own."""
    print(json.dumps(document, separators=(", ", ": "), allow_nan=False), flush=True)


def asked(url: str, token: str, ask: Callable[[Client], R]) -> R:
    """The answer of the gateway at ``url``; its errors become CliErrors."""
    from onemap_tools.gateway import gateway_client

    with gateway_client(url, token) as gateway:
        return ask(gateway)


def show(
    document: dict[str, Any], as_json: bool, describe: Callable[[dict[str, Any], Console], None]
) -> None:
    """Print a result for people, and as JSON if asked."""
    describe(document, result_console(as_json))
    if as_json:
        print_json(document)
