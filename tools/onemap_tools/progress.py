"""Shows a running search, line by line."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Any

from rich.console import Console

LINE_EVERY_S = 5.0


@dataclass(frozen=True, slots=True)
class SearchProgress:
    """A search as the gateway reports it, with what is known of map and robot, None if nothing.

    map_age_s: since the map last changed; map_rate_hz: its updates per second. position_m: the
    robot's x, y in the map frame. name: the robot's, empty if there is one.
    """

    report: dict[str, Any]
    map_age_s: float | None = None
    map_rate_hz: float | None = None
    position_m: tuple[float, float] | None = None
    name: str = ""

    @property
    def robot(self) -> str:
        """Position and path length in words."""
        driven = f"drove {self.report['path_length_m']:.1f} m"
        if self.position_m is None:
            return driven
        return f"({self.position_m[0]:.1f}, {self.position_m[1]:.1f}) m, {driven}"

    @property
    def map(self) -> str:
        """Age and rate of the map in words; empty if the age is unknown."""
        if self.map_age_s is None:
            return ""
        known = self.map_rate_hz is not None and isfinite(self.map_rate_hz)
        rate = f", {self.map_rate_hz:.1f} updates/s" if known else ""
        return f"{self.map_age_s:.1f} s old{rate}"


class ProgressLines:
    """Prints a line at every change of state of a robot and every five seconds."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._last: dict[str, tuple[object, ...]] = {}  # by the robot's name
        self._due_s: dict[str, float] = {}

    def wait(self, elapsed_s: float, what: str) -> None:
        """Show why there is no progress yet."""
        self._line("", elapsed_s, (what.partition(":")[0],), what)  # seconds may follow

    def show(self, progress: SearchProgress) -> None:
        """Show the state of the search."""
        report = progress.report
        done, count = len(report["results"]), len(report["objects"])
        text = (
            f"{f'[{done}/{count}] ' if count else ''}{report['target'] or 'search'}: "
            f"{report['state'].replace('_', ' ')}: {report['reason']}; "
            f"robot {progress.robot}{f'; map {progress.map}' if progress.map else ''}"
        )
        self._line(progress.name, report["elapsed_s"], (report["target"], report["state"]), text)

    def _line(self, name: str, elapsed_s: float, subject: tuple[object, ...], text: str) -> None:
        if subject == self._last.get(name) and elapsed_s < self._due_s[name]:
            return
        self._last[name], self._due_s[name] = subject, elapsed_s + LINE_EVERY_S
        robot = f"{name}  " if name else ""
        self._console.print(f"{elapsed_s:6.1f} s  {robot}{text}", soft_wrap=True)
