"""What a person sees while the robot searches: a live panel, or a line now and then."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from types import TracebackType
from typing import Protocol

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

LINE_EVERY_S = 5.0
COLOURS = {"found": "green", "not_found": "yellow", "failed": "red", "cancelled": "yellow"}
BAR_WIDTH = 40


@dataclass(frozen=True, slots=True)
class SearchProgress:
    """A search at one instant. ``done``: name and outcome of the objects that are settled.

    Position, map age and map rate are None where nobody tells them.
    """

    elapsed_s: float
    objects: tuple[str, ...]
    done: tuple[tuple[str, str], ...]
    target: str
    state: str
    reason: str
    path_length_m: float
    position_m: tuple[float, float] | None = None
    map_age_s: float | None = None
    map_rate_hz: float | None = None

    @property
    def robot(self) -> str:
        """Where the robot is and how far it drove."""
        driven = f"drove {self.path_length_m:.1f} m"
        if self.position_m is None:
            return driven
        return f"({self.position_m[0]:.1f}, {self.position_m[1]:.1f}) m, {driven}"

    @property
    def map(self) -> str:
        """How old the map is and how often it is updated; empty if nobody tells."""
        if self.map_age_s is None:
            return ""
        age = f"{self.map_age_s:.1f} s old"
        known = self.map_rate_hz is not None and isfinite(self.map_rate_hz)
        return f"{age}, {self.map_rate_hz:.1f} updates/s" if known else age


class ProgressView(Protocol):
    """Shows a wait or a search as it goes on; a context manager."""

    def __enter__(self) -> ProgressView: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...

    def wait(self, elapsed_s: float, what: str) -> None:
        """Nothing to see yet, because of this."""

    def show(self, progress: SearchProgress) -> None:
        """The search stands like this."""


def progress_view(console: Console) -> ProgressView:
    """The live panel on a terminal, lines elsewhere."""
    return LiveView(console) if console.is_terminal else LineView(console)


class LineView:
    """A line when something changes, and every five seconds."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._said: tuple[object, ...] = ()
        self._due_s = 0.0

    def __enter__(self) -> LineView:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        return

    def wait(self, elapsed_s: float, what: str) -> None:
        """See ``ProgressView``."""
        self._line(elapsed_s, (what,), what)

    def show(self, progress: SearchProgress) -> None:
        """See ``ProgressView``."""
        settled = f"{len(progress.done)}/{len(progress.objects)}"
        known = f"map {progress.map}; " if progress.map else ""
        text = (
            f"[{settled}] {progress.target or 'search'}: {progress.state}; robot {progress.robot}; "
            f"{known}{progress.reason}"
        )
        self._line(progress.elapsed_s, (progress.target, progress.state), text)

    def _line(self, elapsed_s: float, subject: tuple[object, ...], text: str) -> None:
        if subject == self._said and elapsed_s < self._due_s:
            return
        self._said, self._due_s = subject, elapsed_s + LINE_EVERY_S
        self._console.print(f"{elapsed_s:6.1f} s  {text}", soft_wrap=True)


class LiveView:
    """A panel that is redrawn in place."""

    def __init__(self, console: Console) -> None:
        self._live = Live(console=console, refresh_per_second=4, transient=True)

    def __enter__(self) -> LiveView:
        self._live.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._live.__exit__(kind, problem, trace)

    def wait(self, elapsed_s: float, what: str) -> None:
        """See ``ProgressView``."""
        self._live.update(Spinner("dots", Text(f"{elapsed_s:5.1f} s  {what}")))

    def show(self, progress: SearchProgress) -> None:
        """See ``ProgressView``."""
        self._live.update(panel(progress))


def panel(progress: SearchProgress) -> Group:
    """The search as a small table under a bar of the objects that are settled."""
    outcomes = dict(progress.done)
    names = Text(" ").join(_object(name, outcomes.get(name), progress) for name in progress.objects)
    table = Table.grid(padding=(0, 2))
    table.add_column(style="dim")
    table.add_column()
    table.add_row("objects", names)
    table.add_row("state", Text(f"{progress.state}: {progress.reason}"))
    table.add_row("robot", Text(progress.robot))
    if progress.map:
        table.add_row("map", Text(progress.map))
    table.add_row("time", Text(f"{progress.elapsed_s:.0f} s"))
    bar = ProgressBar(total=len(progress.objects), completed=len(progress.done), width=BAR_WIDTH)
    return Group(bar, table)


def _object(name: str, outcome: str | None, progress: SearchProgress) -> Text:
    if outcome is not None:
        return Text(f"{name} ({outcome.replace('_', ' ')})", style=COLOURS.get(outcome, ""))
    return Text(name, style="bold" if name == progress.target else "dim")
