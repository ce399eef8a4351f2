"""Shows a running search: a live panel on a terminal, lines elsewhere."""

from __future__ import annotations

from abc import abstractmethod
from contextlib import AbstractContextManager
from dataclasses import dataclass
from math import isfinite
from typing import Any

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
    "not_found": "yellow",
    "failed": "red",
    "cancelled": "yellow",
    "interrupted": "yellow",
}
BAR_WIDTH = 40


@dataclass(frozen=True, slots=True)
class MapUpdates:
    """Seconds since the map last changed, and updates per second; None where unknown."""

    age_s: float | None = None
    rate_hz: float | None = None

    def __str__(self) -> str:
        """Age and rate in words; empty if the age is unknown."""
        if self.age_s is None:
            return ""
        age = f"{self.age_s:.1f} s old"
        known = self.rate_hz is not None and isfinite(self.rate_hz)
        return f"{age}, {self.rate_hz:.1f} updates/s" if known else age


@dataclass(frozen=True, slots=True)
class SearchProgress:
    """A search at one instant; a drive to a place has no objects.

    ``done``: name and outcome of the objects that are finished. ``position_m``: the robot's x, y
    in the map frame; None where unknown. ``name``: the robot's, empty if there is one.
    """

    elapsed_s: float
    objects: tuple[str, ...]
    done: tuple[tuple[str, str], ...]
    target: str
    state: str
    reason: str
    path_length_m: float
    position_m: tuple[float, float] | None = None
    map: MapUpdates = MapUpdates()
    name: str = ""

    @property
    def robot(self) -> str:
        """Position and path length in words."""
        driven = f"drove {self.path_length_m:.1f} m"
        if self.position_m is None:
            return driven
        return f"({self.position_m[0]:.1f}, {self.position_m[1]:.1f}) m, {driven}"


def progress_of(
    report: dict[str, Any],
    updates: MapUpdates,
    position_m: tuple[float, float] | None = None,
) -> SearchProgress:
    """The progress of a search from the gateway's report, with what is known of map and robot."""
    return SearchProgress(
        elapsed_s=report["elapsed_s"],
        objects=tuple(report["objects"]),
        done=tuple((result["name"], result["outcome"]) for result in report["results"]),
        target=report["target"],
        state=report["state"],
        reason=report["reason"],
        path_length_m=report["path_length_m"],
        position_m=position_m,
        map=updates,
    )


class ProgressView(AbstractContextManager["ProgressView"]):
    """Displays a wait or a running search of each robot."""

    def __exit__(self, *_: object) -> None:
        """End the display."""

    @abstractmethod
    def wait(self, elapsed_s: float, what: str) -> None:
        """Show why there is no progress yet."""

    @abstractmethod
    def show(self, progress: SearchProgress) -> None:
        """Show the state of the search."""


def progress_view(console: Console) -> ProgressView:
    """A live panel on a terminal, lines elsewhere."""
    return LiveView(console) if console.is_terminal else LineView(console)


class LineView(ProgressView):
    """Prints a line at every change of state of a robot and every five seconds."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._last: dict[str, tuple[object, ...]] = {}  # by the robot's name
        self._due_s: dict[str, float] = {}

    def wait(self, elapsed_s: float, what: str) -> None:
        """See ``ProgressView``."""
        self._line("", elapsed_s, (what.partition(":")[0],), what)  # seconds may follow

    def show(self, progress: SearchProgress) -> None:
        """See ``ProgressView``."""
        done = f"[{len(progress.done)}/{len(progress.objects)}] " if progress.objects else ""
        updates = str(progress.map)
        of_map = f"map {updates}; " if updates else ""
        text = (
            f"{done}{progress.target or 'search'}: {progress.state}; robot {progress.robot}; "
            f"{of_map}{progress.reason}"
        )
        self._line(progress.name, progress.elapsed_s, (progress.target, progress.state), text)

    def _line(self, name: str, elapsed_s: float, subject: tuple[object, ...], text: str) -> None:
        if subject == self._last.get(name) and elapsed_s < self._due_s[name]:
            return
        self._last[name], self._due_s[name] = subject, elapsed_s + LINE_EVERY_S
        robot = f"{name}  " if name else ""
        self._console.print(f"{elapsed_s:6.1f} s  {robot}{text}", soft_wrap=True)


class LiveView(ProgressView):
    """A panel for each robot, redrawn in place."""

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
        """See ``ProgressView``."""
        self._live.update(Spinner("dots", Text(f"{elapsed_s:5.1f} s  {what}")))

    def show(self, progress: SearchProgress) -> None:
        """See ``ProgressView``."""
        self._panels[progress.name] = panel(progress)
        self._live.update(Group(*self._panels.values()))


def panel(progress: SearchProgress) -> Group:
    """A table of the search under a progress bar of the finished objects."""
    outcomes = dict(progress.done)
    names = Text(" ").join(_object(name, outcomes.get(name), progress) for name in progress.objects)
    table = Table.grid(padding=(0, 2))
    table.add_column(style="dim")
    table.add_column()
    if progress.objects:
        table.add_row("objects", names)
    table.add_row("state", Text(f"{progress.state}: {progress.reason}"))
    name = f"{progress.name} " if progress.name else ""
    table.add_row("robot", Text(f"{name}{progress.robot}"))
    if updates := str(progress.map):
        table.add_row("map", Text(updates))
    table.add_row("time", Text(f"{progress.elapsed_s:.0f} s"))
    bar = ProgressBar(total=len(progress.objects), completed=len(progress.done), width=BAR_WIDTH)
    return Group(bar, table) if progress.objects else Group(table)


def _object(name: str, outcome: str | None, progress: SearchProgress) -> Text:
    if outcome is not None:
        return Text(f"{name} ({outcome.replace('_', ' ')})", style=COLOURS.get(outcome, ""))
    return Text(name, style="bold" if name == progress.target else "dim")
