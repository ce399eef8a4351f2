"""Monitors a demo run on the bus: driven path, rate and age of the map, ground truth."""

from __future__ import annotations

import time
from typing import TypeVar

from onemap_shared.geometry import yaw_of
from onemap_shared.keys import (
    MAP_REVISION,
    MAP_SEARCH_VIEW,
    ROBOT_ODOMETRY,
    ROBOT_TRUTH,
    heartbeat,
)
from onemap_shared.messages import MapRevision, SearchView, SearchViewRequest, Truth, TruthRequest
from onemap_shared.rates import mean_rate_hz
from onemap_shared.runner import is_starting
from onemap_shared.trail import PointM, extended
from onemap_shared.transport import Bus, CallError, Subscription
from onemap_tools.progress import MapUpdates

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
