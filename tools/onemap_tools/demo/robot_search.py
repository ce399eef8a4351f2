"""The searches of one robot of a demo, from the first to the last."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from math import dist, inf
from typing import Any

from onemap import Client
from onemap_shared.messages import SearchState
from onemap_tools.demo.robots import DemoRobot
from onemap_tools.demo.run_monitor import RunMonitor
from onemap_tools.gateway import SearchHandle
from onemap_tools.progress import SearchProgress, progress_of

Round = tuple[str, ...]  # the objects of one search, in order


class RobotSearch:
    """A robot, its gateway, its monitor, and the searches that it was given."""

    def __init__(self, robot: DemoRobot, gateway: Client, monitor: RunMonitor) -> None:
        self.robot, self.gateway, self.monitor = robot, gateway, monitor
        self._handles: list[SearchHandle] = []

    @property
    def active(self) -> bool:
        """Whether it searches."""
        return bool(self._handles) and self._handles[-1].active

    @property
    def results(self) -> list[dict[str, Any]]:
        """The gateway's results for the objects that it finished with."""
        return [result for handle in self._handles for result in handle.report["results"]]

    @property
    def path_length_m(self) -> float:
        """Metres that it drove in its searches."""
        return sum(float(handle.report["path_length_m"]) for handle in self._handles)

    @property
    def search_s(self) -> float:
        """Seconds that its searches took."""
        return sum(float(handle.report["elapsed_s"]) for handle in self._handles)

    @property
    def failure(self) -> str:
        """Why a search as a whole did not come to its end; empty if all ran to their end."""
        early = (SearchState.FAILED, SearchState.CANCELLED, SearchState.INTERRUPTED)
        reasons = [
            str(handle.report["reason"])
            for handle in self._handles
            if handle.report["state"] in early
        ]
        name = f"{self.robot.name}: " if self.robot.name else ""
        return f"{name}{reasons[0]}" if reasons else ""

    @property
    def progress(self) -> SearchProgress:
        """Its newest search; there must be one."""
        monitor = self.monitor
        progress = progress_of(self._handles[-1].report, monitor.map_updates, monitor.position_m)
        return replace(progress, name=self.robot.name)

    def begin(self, objects: Round) -> None:
        """Search for these objects."""
        self._handles.append(SearchHandle(self.gateway.search(objects)))

    def update(self, now_s: float) -> None:
        """Take what the bus brought since the last update, and ask how the search goes."""
        self.monitor.update(now_s)
        if self.active:
            self._handles[-1].poll()

    def cancel(self) -> None:
        """End its search, if there is one."""
        if self.active:
            self._handles[-1].cancel()


def rounds_of(objects: Sequence[str], robots: int) -> deque[Round]:
    """One search for all objects by one robot; one for each of them, of several robots."""
    return deque([tuple(objects)] if robots == 1 else [(name,) for name in objects])


def deal(rounds: deque[Round], searches: Sequence[RobotSearch]) -> bool:
    """Give the next rounds to the robots that are free; whether any robot searches."""
    for search in searches:
        if rounds and not search.active:
            search.begin(rounds.popleft())
    return any(search.active for search in searches)


def separation_m(searches: Sequence[RobotSearch]) -> float:
    """Metres between the middles of the two robots that are nearest to each other, or infinity."""
    places = [search.monitor.position_m for search in searches]
    known = [place for place in places if place is not None]
    return min((dist(one, other) for one, other in combinations(known, 2)), default=inf)
