"""``onemap live``: a WebSocket server for Foxglove and Lichtblick, beside a running robot."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from onemap_gateway.bus.live_state import LiveState
from onemap_shared import keys
from onemap_shared.config import BusConfig, read, section
from onemap_shared.geometry import F32, U8
from onemap_shared.keys import Topic
from onemap_shared.messages import (
    Detections,
    Heartbeat,
    MapRevision,
    ObjectListRequest,
    Odometry,
    PlannedPath,
    RgbdFrame,
    SearchStatus,
    SearchView,
    SearchViewRequest,
    VelocityCommand,
)
from onemap_shared.services import SERVICES
from onemap_shared.transport import Bus, CallError
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.interrupts import interruptible
from onemap_tools.processes.session import temporary_session
from onemap_tools.recording import foxglove as convert
from onemap_tools.recording import foxglove_server as topics
from onemap_tools.recording.foxglove_server import FoxgloveServer
from onemap_tools.recording.map_colours import belief_rgba, occupancy_rgba, similarity_rgba

CONNECT_S = 5.0
UPDATE_S = 0.03
HOST = "127.0.0.1"  # what the robot sees is for this machine; others come through a tunnel
STREAMS: tuple[tuple[Topic[Any], int], ...] = (
    (keys.ROBOT_RGBD, 1),
    (keys.ROBOT_ODOMETRY, 1),
    (keys.ROBOT_CMD_VEL, 1),
    (keys.DETECTIONS, 1),
    (keys.MAP_REVISION, 1),
    (keys.SEARCH_STATE, 16),
    (keys.SEARCH_PATH, 1),
    (keys.ALL_HEARTBEATS, 16),
)
MAP_EVERY_S = 1.0  # a view of the map is up to 1 MB, and a planner asks for its own
REPEAT_S = 3.0  # of what changes seldom, for viewers that connect later
CALL_S = 0.5  # the mapper answers within 0.1 s; frames wait meanwhile
LAYER_M = 0.01  # between two layers of the map, so that neither covers the other
NONE = np.zeros((0, 4), np.float32)
NO_PLAN = PlannedPath(
    0, "none", "the search is over", *(NONE[:, :2],) * 3, NONE[:, 0], NONE[:, :2], NONE[:, 0]
)
NO_DETECTIONS = Detections(1, 1, "", (), NONE, NONE[:, 0], NONE[:, :3], np.zeros(0, np.int32))


def live(config: Path | None, port: int, query: str, console: Console) -> None:
    """Serve until SIGINT or SIGTERM; CliError without a router or if the port is taken.

    ``port`` 0: any that is free. ``query``: empty: what a search looks for.
    """
    bus_config = section(read(config), "bus", BusConfig)
    with interruptible() as stop, temporary_session(bus_config, "viewer", CONNECT_S) as bus:
        server = listening(port, query)
        try:
            console.print(
                f"Foxglove or Lichtblick: open a connection to ws://{HOST}:{server.port}; layout: "
                "deploy/foxglove/onemap.json. Ctrl-C ends it.",
                soft_wrap=True,
            )
            viewer = LiveViewer(bus, server)
            while not stop.wait(UPDATE_S):
                viewer.update(time.monotonic(), time.time_ns())
        finally:
            server.close()


def listening(port: int, query: str) -> FoxgloveServer:
    """A server on loopback; CliError if the port is taken."""
    try:
        return FoxgloveServer(HOST, port, query)
    except RuntimeError as problem:  # of the SDK, which has no class of its own for it
        raise CliError(
            f"Cannot listen on {HOST}:{port} ({problem}): choose another --port.",
            EXIT_USAGE_ERROR,
        ) from problem


class LiveViewer:
    """Call ``update`` often; what no viewer has subscribed to is not computed."""

    def __init__(self, bus: Bus, server: FoxgloveServer) -> None:
        self._bus = bus
        self._server = server
        self._subscriptions = [bus.subscribe(topic, capacity) for topic, capacity in STREAMS]
        self._state = LiveState()
        self._now_s, self._now_ns = 0.0, 0
        self._map_due_s = self._repeat_due_s = 0.0
        self._shown: dict[str, str] = {}  # the last log line of each source
        self._map_of: tuple[Any, ...] = ()

    def update(self, now_s: float, now_ns: int) -> None:
        """Pass on all messages since the last update, and the map if it is due.

        now_s: of a monotonic clock; now_ns: of the wall clock.
        """
        self._now_s, self._now_ns = now_s, now_ns
        for subscription in self._subscriptions:
            while (message := subscription.take(0.0)) is not None:
                self._show(message)
        repeat = now_s >= self._repeat_due_s
        if repeat:
            self._repeat_due_s = now_s + REPEAT_S
            self._repeat()
        if now_s >= self._map_due_s:
            self._map_due_s = now_s + MAP_EVERY_S
            self._show_map(repeat=repeat)
            self._show_objects()

    def _send(self, topic: str, make: Callable[[], Any]) -> None:
        if self._server.wanted(topic):
            self._server.send(topic, make(), self._now_ns)

    def _show(self, message: Any) -> None:
        if isinstance(message, VelocityCommand):
            self._send(topics.COMMAND, lambda: convert.speed(message))
            return
        self._state = self._state.with_message(message, self._now_s)
        match message:
            case RgbdFrame():
                self._show_pose(message.T_map_camera, convert.CAMERA, message.stamp_ns)
                self._send(topics.CALIBRATION, lambda: convert.calibration(message))
                self._send(topics.IMAGE, lambda: convert.camera_image(message))
                self._send(topics.POINTS, lambda: convert.frame_cloud(message))
            case Odometry():
                self._show_pose(message.T_map_body, convert.BODY, message.stamp_ns)
                self._send(topics.MOTION, lambda: convert.speed(message))
                self._send(topics.ROBOT, lambda: convert.robot_scene(message, self._state.trail_m))
            case Detections():
                self._send(topics.BOXES, lambda: convert.boxes_in_image(message))
                self._send(topics.DETECTED, lambda: convert.detected_cloud(message))
            case MapRevision():
                self._send(topics.MAP_STATE, lambda: convert.map_state(message, self._now_ns))
            case SearchStatus():
                self._show_search(message)
            case PlannedPath():
                self._send(topics.PLAN, lambda: convert.plan_scene(message))
            case Heartbeat() if message.service in SERVICES:
                topic = topics.service_topic(message.service)
                self._send(topic, lambda: convert.service_state(message))
                problem = message.problem
                self._log(message.service, problem or "is well", problem=bool(problem))

    def _show_pose(self, T_map_child: Any, child: str, stamp_ns: int) -> None:
        self._send(topics.TRANSFORMS, lambda: convert.transforms(T_map_child, child, stamp_ns))

    def _show_search(self, status: SearchStatus) -> None:
        self._send(topics.SEARCH, lambda: convert.search_state(status))
        self._log("search", status.reason, problem=False)
        if not status.active:  # nobody renews the plan and the boxes any more
            plan = replace(NO_PLAN, stamp_ns=self._now_ns)
            boxes = replace(NO_DETECTIONS, stamp_ns=self._now_ns)
            self._send(topics.PLAN, lambda: convert.plan_scene(plan))
            self._send(topics.BOXES, lambda: convert.boxes_in_image(boxes))
            self._send(topics.DETECTED, lambda: convert.detected_cloud(NO_DETECTIONS))

    def _log(self, name: str, text: str, *, problem: bool) -> None:
        if text and self._shown.get(name) != text and self._server.wanted(topics.LOG):
            self._shown[name] = text
            line = convert.log_line(name, text, self._now_ns, problem=problem)
            self._server.send(topics.LOG, line, self._now_ns)

    def _repeat(self) -> None:
        """Once more what a viewer that has just connected would wait for."""
        search, revision = self._state.search, self._state.revision
        if search is not None:
            self._send(topics.SEARCH, lambda: convert.search_state(search.message))
        if revision is not None:
            self._send(topics.MAP_STATE, lambda: convert.map_state(revision.message, self._now_ns))

    def _show_map(self, *, repeat: bool) -> None:
        """The layers of the map, if it or the text has changed, or as a repetition."""
        wanted = [self._server.wanted(topic) for topic in topics.MAP_LAYERS]
        if not any(wanted):
            return
        searched = self._state.search.message.target if self._state.search is not None else ""
        text = self._server.query or searched
        revision = self._state.revision.message.revision if self._state.revision else 0
        if (revision, text, *wanted) == self._map_of and not repeat:
            return
        try:
            view = self._bus.call(keys.MAP_SEARCH_VIEW, SearchViewRequest(text), CALL_S)
        except CallError as problem:
            self._log("map", str(problem), problem=True)
            return
        self._map_of = (revision, text, *wanted)
        self._log("map", f"shows {text!r}" if text else "shows no text", problem=False)
        self._send_layer(0, view, occupancy_rgba(view.occupancy), view.occupancy)
        self._send_layer(1, view, belief_rgba(view.layers), view.layers)
        if view.similarity.size:
            self._send_layer(2, view, similarity_rgba(view.similarity), view.similarity)

    def _send_layer(self, index: int, view: SearchView, rgba: U8, value: U8 | F32) -> None:
        values, stamp_ns, height_m = value.astype(np.float32), view.stamp_ns, LAYER_M * index
        self._send(
            topics.MAP_LAYERS[index],
            lambda: convert.grid(view.grid, rgba, values, stamp_ns=stamp_ns, height_m=height_m),
        )

    def _show_objects(self) -> None:
        if not self._server.wanted(topics.OBJECTS):
            return
        try:
            found = self._bus.call(keys.MAP_OBJECTS, ObjectListRequest(), CALL_S)
        except CallError as problem:
            self._log("objects", str(problem), problem=True)
            return
        scene = convert.object_scene(found.objects, self._now_ns)
        self._server.send(topics.OBJECTS, scene, self._now_ns)
