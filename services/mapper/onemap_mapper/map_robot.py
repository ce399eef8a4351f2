"""One robot of a map on the bus: its keys, the order of its frames, and what is said of them.

Several robots may share a map. What one of them sends late, or not at all, concerns that robot.
"""
# Talks: a robot of the map on the bus.

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import TypeAlias, TypeVar

from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.coverage_cache import CoverageCache
from onemap_mapper.diagnostics.telemetry import MapperTelemetry
from onemap_mapper.frame_history import FrameHistory
from onemap_mapper.frame_order import FrameOrder, FrameStamp, OriginCheck
from onemap_mapper.map_queries import MapQueries
from onemap_mapper.replies import revision_of
from onemap_shared import keys
from onemap_shared.keys import Procedure
from onemap_shared.messages import (
    AnsweredQuery,
    FeatureField,
    FrameReceipt,
    Heartbeat,
    PoseGraph,
)
from onemap_shared.runner import HEARTBEAT_S, StartError
from onemap_shared.transport import Bus, Health

Q = TypeVar("Q")
R = TypeVar("R")
Space: TypeAlias = Callable[[], tuple[str, int]]  # text space of the map, and its channels
SERVICE = "mapper"


class MapRobot:
    """A robot by its number in the map, 0 for the one under whose keys the mapper runs.

    arrived: set with each of its fields; space: of the map. One thread takes and judges fields;
    queries and coverages are for any. Its own perception embeds its queries: that of another robot
    may be away.
    """

    def __init__(
        self,
        number: int,
        bus: Bus,
        config: MapperConfig,
        arrived: threading.Event,
        space: Space,
    ) -> None:
        self.number, self.bus = number, bus
        self.encoder_seen = ""
        self.telemetry = MapperTelemetry()
        self.queries = MapQueries(bus, config.torch_device, space)
        self.coverages = CoverageCache(config, time.monotonic)
        self._config = config
        self._order, self._origin = FrameOrder(), OriginCheck()
        self._fields = bus.subscribe(keys.FIELD, arrived=arrived)
        self._graphs = bus.subscribe(keys.ROBOT_POSE_GRAPH)
        self._receipts = bus.publish(keys.FIELD_RECEIPTS)
        self._revisions = bus.publish(keys.MAP_REVISION)
        self._answered = bus.publish(keys.MAP_QUERIES)
        self._heartbeats = bus.publish(keys.heartbeat(SERVICE)) if number else None
        self._beat_due_s = 0.0

    def take_field(self) -> FeatureField | None:
        """The newest field, if one has arrived; its sender is told."""
        field = self._fields.take(0.0)
        if field is None:
            return None
        self._receipts.put(FrameReceipt(field.sequence, field.stamp_ns))
        if field.encoder_id != self.encoder_seen:
            self.encoder_seen = field.encoder_id
            self.queries.clear()
        return field

    def take_graph(self) -> PoseGraph | None:
        """The newest pose graph, if one has arrived."""
        return self._graphs.take(0.0)

    def is_late(self, field: FeatureField, history: FrameHistory) -> bool:
        """Whether a field is older than the robot's newest frame in the map; counts it."""
        newest = FrameStamp(history.sequence, history.stamp_ns)
        late = self._order.is_late(FrameStamp(field.sequence, field.stamp_ns), newest)
        self.telemetry.late += late
        return late

    def origin_problem(self, field: FeatureField, history: FrameHistory) -> str:
        """Why a field may be in another frame than the map, in one sentence; empty if it is not."""
        far_m = self._origin.distance_m(field.sequence, field.T_map_camera[:3, 3], history.camera_m)
        if not far_m:
            return ""
        return (
            f"robot {self.bus.namespace or self.number} counts its frames anew {far_m:.1f} m from "
            "where it was: its poses may be in another frame than the shared map, so they are left "
            "out of it; clear the map, or restart the mapper if the poses are right"
        )

    def announce(self, belief: BeliefMap, objects_version: int) -> None:
        """Publish the revision of the map; the caller holds the map's lock."""
        self._revisions.put(
            revision_of(
                belief,
                update_ms=self.telemetry.update_ms,
                rate_hz=self.telemetry.rate_hz(time.monotonic()),
                objects_version=objects_version,
                robot=self.number,
            )
        )

    def answered(self, query: AnsweredQuery) -> None:
        """Publish what was asked and answered."""
        self._answered.put(query)

    def replaced(self) -> None:
        """Forget what was computed from the map: it is another one."""
        self.coverages = CoverageCache(self._config, time.monotonic)
        self.telemetry.reset_floor()

    def metrics(self, history: FrameHistory, now_s: float) -> dict[str, float]:
        """Numbers of its frames for the heartbeat."""
        numbers = {"robot_frames_fused": float(history.frames)}
        if history.stamp_ns:
            numbers["map_age_s"] = (time.time_ns() - history.stamp_ns) * 1e-9
        return numbers | self.telemetry.metrics(now_s, self._fields.counters)

    def beat(self, progress: int, health: Callable[[], Health]) -> None:
        """Publish a further robot's heartbeat if it is due; the runner sees to the first one's."""
        now_s = time.monotonic()
        if self._heartbeats is None or now_s < self._beat_due_s:
            return
        self._beat_due_s = now_s + HEARTBEAT_S
        found = health()
        self._heartbeats.put(
            Heartbeat(
                service=SERVICE,
                instance=self.bus.instance,
                stamp_ns=time.time_ns(),
                progress=progress,
                ready=found.ready,
                problem=found.problem,
                metrics={**self.bus.metrics(), **(found.metrics or {})},
            )
        )

    def close(self, progress: int) -> None:
        """Leave the keys of a further robot; the runner leaves those of the first one."""
        if self._heartbeats is None:
            return
        self._beat_due_s = 0.0
        self.beat(progress, lambda: Health(ready=False, problem="it is stopping"))
        self.bus.close()


class AllRobots:
    """Serves procedures that are the same for all robots of a map, one request at a time."""

    def __init__(self, robots: tuple[MapRobot, ...]) -> None:
        self._robots = robots

    def serve(self, procedure: Procedure[Q, R], handler: Callable[[Q], R]) -> None:
        """Serve under the keys of every robot."""
        turn = threading.Lock()

        def in_turn(request: Q) -> R:
            with turn:
                return handler(request)

        for robot in self._robots:
            robot.bus.serve(procedure, in_turn)


def buses_of(bus: Bus, robots: Sequence[str]) -> tuple[Bus, ...]:
    """``bus``, then one under the keys of each further robot of the map, by its namespace.

    Raises StartError if another mapper runs under the keys of one of them.
    """
    buses = [bus]
    for namespace in robots:
        if namespace == bus.namespace:
            continue
        sibling = bus.sibling(namespace)
        try:
            others = sibling.claim()
        except ConnectionError as problem:
            raise StartError(str(problem), temporary=True) from problem
        if others:
            sibling.close()
            raise StartError(
                f"{', '.join(others)} runs under the keys of {namespace}, which mapper.robots "
                "names: stop it first, a shared map has one mapper",
                temporary=True,
            )
        buses.append(sibling)
    return tuple(buses)
