"""One robot of a map on the bus: its keys, the order of its frames, and what is said of them.

Several robots may share a map. What one of them sends late, or not at all, concerns that robot.
Late frames are told by their sequence, because a robot's clock may be set back; and of a robot
that counts anew elsewhere the poses may be in another frame of reference.
"""
# Talks: a robot of the map on the bus.

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias, TypeVar

import numpy as np
import torch

from onemap_mapper.belief.version import FrameHistory
from onemap_mapper.frame.camera_check import DepthDiagnostics, FloorMonitor
from onemap_mapper.query.replies import revision_of
from onemap_mapper.query.texts import MapQueries
from onemap_mapper.session import MapSession
from onemap_shared import keys
from onemap_shared.clock import Event
from onemap_shared.geometry import F64
from onemap_shared.keys import Procedure
from onemap_shared.messages import (
    CameraView,
    FeatureField,
    FrameReceipt,
    Heartbeat,
)
from onemap_shared.rates import RateMeter
from onemap_shared.runner import HEARTBEAT_S, StartError
from onemap_shared.services import DRIVER, installed_version, role_of
from onemap_shared.transport import Bus, Counters, Health

SILENT_AFTER_S = 5.0  # without a frame for this long the map is not up to date


@dataclass(slots=True)
class MapperTelemetry:
    """What happened to the frames so far. Times are monotonic seconds. Not thread-safe."""

    rejected: int = 0
    late: int = 0
    rejection: str = ""  # why the newest frame was rejected, empty if it was fused
    update_ms: float = 0.0
    depth: DepthDiagnostics | None = None  # the newest, of the frame of this stamp
    diagnosed_ns: int | None = None
    _floor: FloorMonitor = field(default_factory=FloorMonitor)
    _fused: RateMeter = field(default_factory=RateMeter)

    def record_fused(
        self, *, now_s: float, update_ms: float, stamp_ns: int, depth: DepthDiagnostics | None
    ) -> None:
        """Count a frame that went into the map; depth: None if it was not diagnosed."""
        self.rejection, self.update_ms = "", update_ms
        self._fused = self._fused.with_event(now_s)
        if depth is None:
            return
        self.depth, self.diagnosed_ns = depth, stamp_ns
        if depth.surface is not None:
            self._floor = self._floor.with_surface(depth.surface, depth.viewpoint, now_s)

    def record_rejected(self, reason: str) -> None:
        """Count a frame that did not."""
        self.rejected += 1
        self.rejection = reason

    def reset_floor(self) -> None:
        """Drop all readings of the floor: a new map may have another frame."""
        self._floor, self.diagnosed_ns = FloorMonitor(), None

    def rate_hz(self, now_s: float) -> float:
        """Frames fused per second."""
        return self._fused.rate_hz(now_s)

    def ready(self, now_s: float) -> bool:
        """Whether frames reach the map."""
        return not self.rejection and self._silent_s(now_s) <= SILENT_AFTER_S

    def metrics(self, now_s: float, counters: Counters) -> dict[str, float]:
        """Numbers for the heartbeat; those of the depth once there was a frame."""
        numbers = {
            "update_ms": self.update_ms,
            "rate_hz": self.rate_hz(now_s),
            "frames_missed": float(counters.missed),
            "frames_refused": float(counters.refused + self.rejected),
            "frames_late": float(self.late),
        }
        if self.depth is not None:
            numbers["depth_valid_fraction"] = self.depth.valid_fraction
            numbers["near_fraction"] = self.depth.near_fraction
            numbers |= self._floor_metrics(now_s)
        return numbers

    def _floor_metrics(self, now_s: float) -> dict[str, float]:
        """How many viewpoints saw a level surface; height, tilt and ``floor_wrong`` only once
        there are enough of them to tell."""
        numbers = {"floor_viewpoints": float(len(self._floor.recent(now_s)))}
        if (floor := self._floor.assessment(now_s)) is not None:
            numbers["floor_height_m"] = floor.height_m
            numbers["floor_tilt_deg"] = math.degrees(floor.tilt_rad)
            numbers["floor_wrong"] = float(floor.wrong)
        return numbers

    def problem(self, now_s: float) -> str:
        """What is wrong, in one sentence; empty if nothing is."""
        if self.rejection:
            return self.rejection
        silent_s = self._silent_s(now_s)
        if math.isinf(silent_s):
            return "waiting for the first frame from perception"
        if silent_s > SILENT_AFTER_S:
            return f"no frame from perception for {silent_s:.0f} s"
        if self.depth is not None and self.depth.problem:
            return self.depth.problem
        floor = self._floor.assessment(now_s)
        return floor.problem if floor else ""

    def _silent_s(self, now_s: float) -> float:
        return self._fused.silent_s(now_s, since_s=-math.inf)


# A frame that is older than the map by this and more is no late one: the clock was set back or
# another recording began.
CLOCK_JUMP_NS = 10 * 10**9
# Frames that seem late, each with a higher sequence than the one before, after which they are the
# stream of a robot that began to count anew.
NEW_STREAM_FRAMES = 3
# A robot that was only started again stands where it was, up to what its localisation errs by and
# the way between the last frame that came and its end.
SAME_PLACE_M = 1.0


@dataclass(slots=True)
class FrameOrder:
    """Tells late frames. Holds the last one, and how many came in a row."""

    _last: int = -1
    _run: int = 0

    def is_late(self, sequence: int, stamp_ns: int, history: FrameHistory) -> bool:
        """Whether a frame was captured before the newest one of its robot in the map."""
        back_ns = history.stamp_ns - stamp_ns
        late = sequence <= history.sequence and 0 < back_ns < CLOCK_JUMP_NS
        self._run = (self._run if sequence > self._last else 0) + 1 if late else 0
        self._last = sequence if late else -1
        return late and self._run < NEW_STREAM_FRAMES


@dataclass(slots=True)
class OriginCheck:
    """Follows the frames of one robot that shares a map. Holds how far off its stream began.

    A robot whose poses begin anew mostly stands elsewhere, by its poses, than it did. Where it does
    not, or where it was carried, nothing tells.
    """

    _last: int = -1
    _far_m: float = 0.0

    def distance_m(self, sequence: int, camera_m: F64, newest_camera_m: F64 | None) -> float:
        """Metres from the robot's newest frame in the map to where it began to count anew.

        0 if it did not, or within ``SAME_PLACE_M``, or if the map holds none of its frames (None).
        It stays until the robot begins anew in place, or the map does.
        """
        if newest_camera_m is None:
            self._far_m = 0.0
        elif sequence < self._last:
            away_m = float(np.linalg.norm(camera_m - newest_camera_m))
            self._far_m = away_m if away_m > SAME_PLACE_M else 0.0
        self._last = sequence
        return self._far_m


Q = TypeVar("Q")
R = TypeVar("R")
Space: TypeAlias = Callable[[], tuple[str, int]]  # text space of the map, and its channels
SERVICE = "mapper"


class MapRobot:
    """A robot by its number in the map, 0 for the one under whose keys the mapper runs.

    arrived: set with each of its fields; space: of the map. One thread takes and judges fields;
    queries are for any. Its own perception embeds its queries: that of another robot
    may be away.
    """

    def __init__(
        self,
        number: int,
        bus: Bus,
        device: torch.device,
        arrived: Event,
        space: Space,
    ) -> None:
        self.number, self.bus, self._clock = number, bus, bus.clock
        self.encoder_seen = ""
        self.world: str | None = None  # of its newest field
        self.camera: tuple[CameraView, ...] = ()  # of its newest fused frame
        self.telemetry = MapperTelemetry()
        self.queries = MapQueries(bus, device, space)
        self._order, self._origin = FrameOrder(), OriginCheck()
        self._fields = bus.subscribe(keys.FIELD, arrived=arrived)
        self._receipts = bus.publish(keys.FIELD_RECEIPTS)
        self._revisions = bus.publish(keys.MAP_REVISION)
        self._heartbeats = bus.publish(keys.heartbeat(SERVICE)) if number else None
        self._beat_due_s = 0.0

    @property
    def driver(self) -> str:
        """Instance of the process that drives it; empty if it is not shown, or several are."""
        members = self.bus.members()
        drivers = [instance for service, instance in members if role_of(service) == DRIVER]
        return drivers[0] if len(drivers) == 1 else ""

    def take_field(self) -> FeatureField | None:
        """The newest field, if one has arrived; its sender is told."""
        field = self._fields.take(0.0)
        if field is None:
            return None
        self._receipts.put(FrameReceipt(field.sequence, field.stamp_ns))
        self.world = field.world
        if field.encoder_id != self.encoder_seen:
            self.encoder_seen = field.encoder_id
            self.queries.clear()
        return field

    def is_late(self, field: FeatureField, history: FrameHistory) -> bool:
        """Whether a field is older than the robot's newest frame in the map; counts it."""
        late = self._order.is_late(field.sequence, field.stamp_ns, history)
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

    def announce(self, session: MapSession, objects_version: int, places_version: int) -> None:
        """Publish the revision of the map; the caller holds the map's lock."""
        revision = revision_of(
            session.belief,
            update_ms=self.telemetry.update_ms,
            rate_hz=self.telemetry.rate_hz(self._clock.monotonic_s()),
            objects_version=objects_version,
            robot=self.number,
        )
        known = replace(revision, camera=self.camera, places_version=places_version)
        self._revisions.put(replace(known, map_id=session.map_id))

    def metrics(self, history: FrameHistory, now_s: float) -> dict[str, float]:
        """Numbers of its frames for the heartbeat."""
        numbers = {"robot_frames_fused": float(history.frames)}
        if history.stamp_ns:
            numbers["map_age_s"] = (self._clock.wall_ns() - history.stamp_ns) * 1e-9
        return numbers | self.telemetry.metrics(now_s, self._fields.counters)

    def beat(self, progress: int, health: Callable[[], Health]) -> None:
        """Publish a further robot's heartbeat if it is due; the runner sees to the first one's."""
        now_s = self._clock.monotonic_s()
        if self._heartbeats is None or now_s < self._beat_due_s:
            return
        self._beat_due_s = now_s + HEARTBEAT_S
        found = health()
        self._heartbeats.put(
            Heartbeat(
                service=SERVICE,
                instance=self.bus.instance,
                stamp_ns=self._clock.wall_ns(),
                progress=progress,
                ready=found.ready,
                problem=found.problem,
                metrics={**self.bus.metrics(), **(found.metrics or {})},
                version=installed_version(),
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
        self._robots, self.clock = robots, robots[0].bus.clock

    def serve(self, procedure: Procedure[Q, R], handler: Callable[[Q], R]) -> None:
        """Serve under the keys of every robot."""
        turn = self.clock.lock()

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
