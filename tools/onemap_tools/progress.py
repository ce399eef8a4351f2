"""Shows a running search: a live panel on a terminal, lines elsewhere."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from math import isfinite
from typing import Any, TypeAlias

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

LINE_EVERY_S = 5.0
COLOURS = {
    "found": "green",
    "arrived": "green",
    "found_other": "yellow",
    "not_found": "yellow",
    "failed": "red",
    "cancelled": "yellow",
    "interrupted": "yellow",
}
BAR_WIDTH = 40


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


class LineView(AbstractContextManager["LineView"]):
    """Prints a line at every change of state of a robot and every five seconds."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._last: dict[str, tuple[object, ...]] = {}  # by the robot's name
        self._due_s: dict[str, float] = {}

    def __exit__(self, *_: object) -> None:
        """Nothing is left to do."""

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


class LiveView(AbstractContextManager["LiveView"]):
    """A panel for each robot, redrawn in place; the methods are those of ``LineView``."""

    def __init__(self, console: Console) -> None:
        self._panels: dict[str, Group] = {}  # by the robot's name
        self._live = Live(console=console, refresh_per_second=4, transient=True)

    def __enter__(self) -> LiveView:
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End the display."""
        self._live.stop()

    def wait(self, elapsed_s: float, what: str) -> None:
        """Show why there is no progress yet."""
        self._live.update(Spinner("dots", Text(f"{elapsed_s:5.1f} s  {what}")))

    def show(self, progress: SearchProgress) -> None:
        """Show the state of the search."""
        self._panels[progress.name] = panel(progress)
        self._live.update(Group(*self._panels.values()))


ProgressView: TypeAlias = "LineView | LiveView"


def progress_view(console: Console) -> ProgressView:
    """A live panel on a terminal, lines elsewhere."""
    return LiveView(console) if console.is_terminal else LineView(console)


def panel(progress: SearchProgress) -> Group:
    """A table of the search under a progress bar of the finished objects."""
    report = progress.report
    objects, results = report["objects"], report["results"]
    table = Table.grid(padding=(0, 2))
    table.add_column(style="dim")
    table.add_column()
    if objects:
        table.add_row("objects", Text(" ").join(_object(name, report) for name in objects))
    table.add_row("state", Text(f"{report['state']}: {report['reason']}"))
    table.add_row("robot", Text(f"{progress.name} {progress.robot}".strip()))
    if progress.map:
        table.add_row("map", Text(progress.map))
    table.add_row("time", Text(f"{report['elapsed_s']:.0f} s"))
    bar = ProgressBar(total=len(objects), completed=len(results), width=BAR_WIDTH)
    return Group(bar, table) if objects else Group(table)


def _object(name: str, report: dict[str, Any]) -> Text:
    outcome = next((r["outcome"] for r in report["results"] if r["name"] == name), None)
    if outcome is not None:
        return Text(f"{name} ({outcome.replace('_', ' ')})", style=COLOURS.get(outcome, ""))
    return Text(name, style="bold" if name == report["target"] else "dim")
