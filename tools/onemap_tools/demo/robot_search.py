"""The searches of one robot of a demo, from the first to the last."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from math import dist, inf
from typing import Any, TypeVar

from onemap import Client
from onemap_shared.geometry import yaw_of
from onemap_shared.keys import (
    MAP_REVISION,
    MAP_SEARCH_VIEW,
    ROBOT_ODOMETRY,
    ROBOT_TRUTH,
    heartbeat,
)
from onemap_shared.messages import (
    MapRevision,
    SearchState,
    SearchView,
    SearchViewRequest,
    Truth,
    TruthRequest,
)
from onemap_shared.rates import mean_rate_hz
from onemap_shared.runner import is_starting
from onemap_shared.trail import PointM, extended
from onemap_shared.transport import Bus, CallError, Subscription
from onemap_tools.demo.robots import DemoRobot
from onemap_tools.gateway import SearchHandle
from onemap_tools.progress import MapUpdates, SearchProgress, progress_of

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


M = TypeVar("M")

QUEUE = 512  # messages held between two updates: odometry at 50 Hz for ten seconds
TRAIL_STEP_M = 0.02  # finer than a pixel of the picture
TRUTH_S = 10.0  # long enough for a busy machine to answer


class RunMonitor:
    """Collects odometry, map revisions and contacts; call ``update`` several times a second.

    robot: the process that simulates it.
    contacts: those above 0.05 m/s that the simulator has counted; None before its first heartbeat.
    compiling: whether the mapper's newest heartbeat says that its start goes on.
    """

    def __init__(self, bus: Bus, robot: str = "simulator") -> None:
        self.bus = bus
        self._odometry = bus.subscribe(ROBOT_ODOMETRY, QUEUE)
        self._revisions = bus.subscribe(MAP_REVISION, QUEUE)
        self._heartbeats = bus.subscribe(heartbeat(robot), QUEUE)
        self._of_mapper = bus.subscribe(heartbeat("mapper"))
        self._counts: list[int] = []
        self._times_s: list[float] = []
        self.trail_m: tuple[PointM, ...] = ()
        self.yaw_rad = 0.0
        self.revision: MapRevision | None = None
        self.contacts: int | None = None
        self.compiling = False

    def update(self, now_s: float) -> None:
        """Take the messages since the last update; ``now_s`` on a monotonic clock."""
        for odometry in waiting(self._odometry):
            x, y = (float(value) for value in odometry.T_map_body[:2, 3])
            self.yaw_rad = yaw_of(odometry.T_map_body)
            self.trail_m = extended(self.trail_m, (x, y), step_m=TRAIL_STEP_M)
        for beat in waiting(self._heartbeats):
            if "collisions" in beat.metrics:
                self.contacts = int(beat.metrics["collisions"])
        for beat in waiting(self._of_mapper):
            self.compiling = is_starting(beat)
        for revision in waiting(self._revisions):
            self.revision = revision
        if self.revision is not None:
            self._counts.append(self.revision.frames_fused)
            self._times_s.append(now_s)

    def restart(self, now_s: float) -> None:
        """Measure the map's rate and the driven path from now on."""
        self.update(now_s)
        self._counts, self._times_s = self._counts[-1:], self._times_s[-1:]
        self.trail_m = self.trail_m[-1:]

    @property
    def map_rate_hz(self) -> float:
        """Frames fused into the map per second since ``restart``; NaN without two readings."""
        return mean_rate_hz(self._counts, self._times_s)

    @property
    def map_age_s(self) -> float | None:
        """Seconds since the newest frame in the map was captured; None without a map."""
        if self.revision is None:
            return None
        return max(time.time_ns() - self.revision.stamp_ns, 0) / 1e9

    @property
    def map_updates(self) -> MapUpdates:
        """Age and rate of the map."""
        return MapUpdates(self.map_age_s, self.map_rate_hz)

    @property
    def position_m(self) -> tuple[float, float] | None:
        """The robot's newest x, y in the map frame; None without odometry."""
        return self.trail_m[-1] if self.trail_m else None

    def truth(self, name: str, place_m: tuple[float, ...]) -> Truth | None:
        """Ground truth for a category at a position; None if the robot does not publish it."""
        x, y = place_m[:2] if len(place_m) >= 2 else (0.0, 0.0)
        try:
            return self.bus.call(ROBOT_TRUTH, TruthRequest(name, x, y), TRUTH_S)
        except CallError:
            return None

    def map_view(self) -> SearchView | None:
        """The map's layers; None if the mapper does not answer."""
        try:
            return self.bus.call(MAP_SEARCH_VIEW, SearchViewRequest())
        except CallError:
            return None


def waiting(subscription: Subscription[M]) -> list[M]:
    """All messages in the queue."""
    messages = []
    while (message := subscription.take(0.0)) is not None:
        messages.append(message)
    return messages
