"""Shows a running search, line by line."""

from __future__ import annotations

import re
from typing import Any

from rich.console import Console

from onemap import Client, OneMapError

LINE_EVERY_S = 5.0


class ProgressLines:
    """Prints a line at every change of state, and every five seconds."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._last: tuple[object, ...] = ()
        self._due_s = 0.0

    def wait(self, elapsed_s: float, what: str) -> None:
        """Show why there is no progress yet."""
        if self._is_due(elapsed_s, re.split("[:,.]", what)[0]):  # seconds may follow
            self._print(elapsed_s, what)

    def show(self, report: dict[str, Any], gateway: Client) -> None:
        """Show the state of the search, with the age of the map."""
        if not self._is_due(report["elapsed_s"], report["target"], report["state"]):
            return
        done, count = len(report["results"]), len(report["objects"])
        self._print(
            report["elapsed_s"],
            f"{f'[{done}/{count}] ' if count else ''}{report['target'] or 'search'}: "
            f"{report['state'].replace('_', ' ')}: {report['reason']}; "
            f"robot drove {report['path_length_m']:.1f} m{_map_age(gateway)}",
        )

    def _is_due(self, elapsed_s: float, *subject: object) -> bool:
        due = subject != self._last or elapsed_s >= self._due_s
        if due:
            self._last, self._due_s = subject, elapsed_s + LINE_EVERY_S
        return due

    def _print(self, elapsed_s: float, text: str) -> None:
        self._console.print(f"{elapsed_s:6.1f} s  {text}", soft_wrap=True)


def _map_age(gateway: Client) -> str:
    """Age and rate of the map in words, which the gateway knows; empty where it does not say."""
    try:
        streams = gateway.status().streams
    except OneMapError:
        return ""
    for stream in streams:
        if stream.name == "revision" and stream.age_s is not None:
            rate = "" if stream.rate_hz is None else f", {stream.rate_hz:.1f} updates/s"
            return f"; map {stream.age_s:.1f} s old{rate}"
    return ""
