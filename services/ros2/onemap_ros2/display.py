"""Publishes what people look at, in a thread, so that a slow mapper delays no command."""
# Talks: asks the mapper, in a thread.

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from onemap_ros2.cdr import DETECTION_ARRAY, GRID, MARKER_ARRAY, PATH, POSE_STAMPED
from onemap_ros2.config import Ros2Config
from onemap_ros2.display_messages import (
    belief_grid,
    detection_array,
    marker_array,
    path_message,
    similarity_grid,
)
from onemap_ros2.drive.driver import encoded_pose, end_of
from onemap_ros2.network.interface import RosNetwork
from onemap_shared.keys import (
    MAP_OBJECTS,
    MAP_REVISION,
    MAP_SEARCH_VIEW,
    SEARCH_PATH,
    SEARCH_STATE,
)
from onemap_shared.messages import (
    KeptObject,
    MapRevision,
    ObjectListRequest,
    PlannedPath,
    SearchStatus,
    SearchViewRequest,
)
from onemap_shared.transport import Bus, CallError

TICK_S = 0.1
MAP_PERIOD_S = 1.0  # each grid is a question to the mapper and a message of a byte per cell
MARKER_PERIOD_S = 0.5  # of markers, detections and paths; the planner plans four times a second
TOPICS = {
    "belief": GRID,
    "similarity": GRID,
    "markers": MARKER_ARRAY,
    "detections": DETECTION_ARRAY,
    "path": PATH,
    "goal": POSE_STAMPED,
}


class Display:
    """Topics of our own; all latched, so that a viewer that starts later shows them at once.

    Nothing is asked of the mapper or encoded while nobody listens.
    """

    def __init__(
        self, bus: Bus, network: RosNetwork, config: Ros2Config, stamp_ns: Callable[[], int]
    ) -> None:
        self._bus, self._config, self._stamp_ns = bus, config, stamp_ns
        prefix = config.in_namespace("/onemap")
        self._writers = {
            name: network.write(f"{prefix}/{name}", ros_type, latched=True)
            for name, ros_type in TOPICS.items()
        }
        self._revisions = bus.subscribe(MAP_REVISION)
        self._states = bus.subscribe(SEARCH_STATE)
        self._paths = bus.subscribe(SEARCH_PATH)
        self._revision: MapRevision | None = None
        self._status: SearchStatus | None = None
        self._path: PlannedPath | None = None
        self._objects: tuple[KeptObject, ...] = ()
        self._objects_version: int | None = None
        self._changed = True
        self._next_map_s = self._next_markers_s = 0.0
        self.grids = 0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="display", daemon=True)

    def start(self) -> None:
        """Publish from now on."""
        self._thread.start()

    def close(self) -> None:
        """Stop, without waiting for the mapper."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(timeout=5.0)

    def step(self, now_s: float) -> None:
        """Publish what is due; ``now_s`` of a monotonic clock."""
        self._take()
        if now_s >= self._next_map_s and self._heard("belief", "similarity"):
            self._next_map_s = now_s + MAP_PERIOD_S
            self._publish_grids()
        if now_s >= self._next_markers_s and self._heard("markers", "detections", "path", "goal"):
            self._next_markers_s = now_s + MARKER_PERIOD_S
            self._take_objects()
            if self._changed:
                self._changed = False
                self._publish_marks()

    def _run(self) -> None:
        while not self._stop.wait(TICK_S):
            self.step(time.monotonic())

    def _take(self) -> None:
        status, path = self._states.take(0.0), self._paths.take(0.0)
        self._revision = self._revisions.take(0.0) or self._revision
        self._status = status or self._status
        if status is not None and not status.active:
            self._changed |= self._path is not None
            self._path = None
        elif path is not None:
            self._path, self._changed = path, True

    def _heard(self, *names: str) -> bool:
        return any(self._writers[name].heard for name in names)

    def _take_objects(self) -> None:
        """Ask for the found objects when their list is another one."""
        if self._revision is None or self._revision.objects_version == self._objects_version:
            return
        try:
            self._objects = self._bus.call(MAP_OBJECTS, ObjectListRequest()).objects
        except CallError:
            return  # asked again with the next markers
        self._objects_version, self._changed = self._revision.objects_version, True

    def _publish_grids(self) -> None:
        target = self._status.target if self._status is not None else ""
        try:
            view = self._bus.call(MAP_SEARCH_VIEW, SearchViewRequest(target))
        except CallError:
            return  # health of the mapper says why
        frame = self._config.map_frame
        self._writers["belief"].put(belief_grid(view, frame))
        self._writers["similarity"].put(similarity_grid(view, frame))
        self.grids += 1

    def _publish_marks(self) -> None:
        stamp_ns, frame = self._stamp_ns(), self._config.map_frame
        self._writers["markers"].put(marker_array(self._objects, self._path, stamp_ns, frame))
        self._writers["detections"].put(detection_array(self._objects, stamp_ns, frame))
        if self._path is None:
            return
        self._writers["path"].put(path_message(self._path, stamp_ns, frame))
        goal = end_of(self._path)
        if goal is not None:
            self._writers["goal"].put(encoded_pose(goal, stamp_ns, frame))
