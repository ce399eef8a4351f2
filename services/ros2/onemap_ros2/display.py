"""Publishes what people look at, in a thread, so that a slow mapper delays no command."""
# Talks: asks the mapper, in a thread.

from __future__ import annotations

import logging
from collections.abc import Callable

import numpy as np

from onemap_ros2 import cdr
from onemap_ros2.config import Ros2Config
from onemap_ros2.display_messages import (
    keepout_info,
    keepout_mask,
    marker_array,
    occupancy_grid,
    path_message,
    similarity_grid,
)
from onemap_ros2.network.interface import RosNetwork
from onemap_shared import keys
from onemap_shared.clock import Thread
from onemap_shared.messages import (
    KeptObject,
    MapRevision,
    ObjectListRequest,
    PlacesRequest,
    PlannedPath,
    SearchStatus,
    SearchView,
    SearchViewRequest,
)
from onemap_shared.places import Zones
from onemap_shared.transport import Bus, CallError, RemoteError

LOG = logging.getLogger("onemap.ros2")
TICK_S = 0.1
MAP_PERIOD_S = 1.0  # each grid is a question to the mapper and a message of a byte per cell
MARKER_PERIOD_S = 0.5  # of markers and paths; the planner plans four times a second
VIEWS: dict[str, Callable[[SearchView, str], bytes]] = {
    "map": occupancy_grid,
    "similarity": similarity_grid,
}
TOPICS = {
    "map": cdr.GRID,
    "similarity": cdr.GRID,
    "markers": cdr.MARKER_ARRAY,
    "path": cdr.PATH,
    "keepout_mask": cdr.GRID,
    "keepout_info": cdr.FILTER_INFO,
}
QUERY = "query"  # topic with the word whose similarity is shown; empty: the object now sought


class Display:
    """Topics of our own; all latched, so that a viewer that starts later shows them at once.

    Nothing is asked of the mapper or encoded while nobody listens.
    """

    def __init__(
        self, bus: Bus, network: RosNetwork, config: Ros2Config, stamp_ns: Callable[[], int]
    ) -> None:
        self._bus, self._config, self._stamp_ns = bus, config, stamp_ns
        prefix = self._prefix = config.in_namespace("/onemap")
        self._writers = {
            name: network.write(f"{prefix}/{name}", ros_type, latched=True)
            for name, ros_type in TOPICS.items()
        }
        self._queries = network.read(f"{prefix}/{QUERY}", cdr.STRING, 1, reliable=True)
        self._revisions = bus.subscribe(keys.MAP_REVISION)
        self._states = bus.subscribe(keys.SEARCH_STATE)
        self._paths = bus.subscribe(keys.SEARCH_PATH)
        self._revision: MapRevision | None = None
        self._status: SearchStatus | None = None
        self._path: PlannedPath | None = None
        self._objects: tuple[KeptObject, ...] = ()
        self._objects_version: int | None = None
        self._changed = True
        self._word = ""  # that was asked for; empty: none
        self._view_version = 0  # counts what changes a view: revisions and words
        self._view_sent: dict[str, int] = {}  # by topic, the version that it shows
        self._mapped: SearchView | None = None  # that ``map`` shows
        self._zones: tuple[object, ...] = ()  # that the keep-out mask shows
        self._next_map_s = self._next_markers_s = self._next_zones_s = 0.0
        self.grids = 0
        self._clock, self._stop = bus.clock, bus.clock.event()
        self._thread: Thread | None = None

    def start(self) -> None:
        """Publish from now on."""
        self._thread = self._clock.thread("display", self._run)

    def close(self) -> None:
        """Stop, without waiting for the mapper."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(timeout=5.0)

    def step(self, now_s: float) -> None:
        """Publish what is due; ``now_s`` of a monotonic clock."""
        self._take()
        if self._has_subscribers("keepout_mask", "keepout_info"):
            self._publish_zones(now_s)
        due = [name for name in VIEWS if self._has_subscribers(name) and self._outdated(name)]
        if due and now_s >= self._next_map_s:
            self._next_map_s = now_s + MAP_PERIOD_S
            self._publish_views(due)
        if now_s >= self._next_markers_s and self._has_subscribers("markers", "path"):
            self._next_markers_s = now_s + MARKER_PERIOD_S
            self._take_objects()
            if self._changed:
                self._changed = False
                self._publish_marks()

    def _run(self) -> None:
        while not self._stop.wait(TICK_S):
            self.step(self._clock.monotonic_s())

    def _take(self) -> None:
        status, path = self._states.take(0.0), self._paths.take(0.0)
        revision, before = self._revisions.take(0.0), self._shown
        self._revision = revision or self._revision
        self._status = status or self._status
        for data in self._queries.take():
            self._ask_for(data)
        if revision is not None or self._shown != before:
            self._view_version += 1
        if status is not None and not status.active:
            self._changed |= self._path is not None
            self._path = None
        elif path is not None:
            self._path, self._changed = path, True

    @property
    def _shown(self) -> str:
        """The word whose similarity is shown; empty without one."""
        return self._word or (self._status.target if self._status is not None else "")

    def _ask_for(self, data: bytes) -> None:
        """Show the similarity of another word, if it is one."""
        try:
            self._word = SearchViewRequest(str(cdr.decode(data, cdr.STRING).data).strip()).text
        except ValueError as problem:
            LOG.warning("no similarity is shown: %s", problem)

    def _outdated(self, name: str) -> bool:
        return self._view_sent.get(name) != self._view_version

    def _has_subscribers(self, *names: str) -> bool:
        return any(self._writers[name].has_subscribers for name in names)

    def _take_objects(self) -> None:
        """Ask for the found objects when their list is another one."""
        if self._revision is None or self._revision.objects_version == self._objects_version:
            return
        try:
            self._objects = self._bus.call(keys.MAP_OBJECTS, ObjectListRequest()).objects
        except CallError:
            return  # asked again with the next markers
        self._objects_version, self._changed = self._revision.objects_version, True

    def _publish_views(self, names: list[str]) -> None:
        version = self._view_version
        try:
            view = self._bus.call(keys.MAP_SEARCH_VIEW, SearchViewRequest(self._shown))
        except RemoteError as problem:
            if self._word:  # which the encoder does not know, most likely
                LOG.warning("no similarity to %r is shown: %s", self._word, problem)
                self._word = ""
            return
        except CallError:
            return  # health of the mapper says why
        for name in names:
            self._view_sent[name] = version
            if name != "map" or self._is_new(view):
                self._writers[name].put(VIEWS[name](view, self._config.map_frame))
        self.grids += 1

    def _publish_zones(self, now_s: float) -> None:
        """Publish the keep-out zones at once when somebody changed them, else as the map grows."""
        revision, status = self._revision, self._status
        if revision is None:
            return
        stay_out = status.stay_out if status is not None and status.active else ()
        zones = (revision.places_version, stay_out, revision.revision)
        if zones == self._zones or (zones[:2] == self._zones[:2] and now_s < self._next_zones_s):
            return
        self._next_zones_s = now_s + MAP_PERIOD_S
        try:
            places = self._bus.call(keys.MAP_PLACES, PlacesRequest())
        except CallError:
            return  # asked again in the next step
        if 0 in places.grid.shape:
            return
        stamp_ns, frame = self._stamp_ns(), self._config.map_frame
        mask = keepout_mask(Zones(places, stay_out), stamp_ns, frame)
        info = keepout_info(f"{self._prefix}/keepout_mask", stamp_ns, frame)
        self._writers["keepout_mask"].put(mask)
        if not self._zones:
            self._writers["keepout_info"].put(info)
        self._zones = zones

    def _is_new(self, view: SearchView) -> bool:
        """Whether the map's cells changed: nav2 computes its whole costmap from each message."""
        before, self._mapped = self._mapped, view
        if 0 in view.grid.shape:
            return False  # before the first frame; nav2 cannot use a map without cells
        if before is None or before.grid != view.grid:
            return True
        return not np.array_equal(before.occupancy, view.occupancy)

    def _publish_marks(self) -> None:
        stamp_ns, frame = self._stamp_ns(), self._config.map_frame
        self._writers["markers"].put(marker_array(self._objects, self._path, stamp_ns, frame))
        self._writers["path"].put(path_message(self._path, stamp_ns, frame))
