"""The latest state of the robot and its services: an immutable snapshot, replaced per message.

Times of arrival are seconds of one monotonic clock, given by the caller, so that ages do not
depend on whether the clocks of two machines agree. A frame is timed in the same way, from its
arrival at the gateway to that of the result with its capture stamp.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import islice
from math import ceil, inf, isfinite
from typing import Any, Generic, TypeAlias, TypeVar

from onemap_shared import messages as m
from onemap_shared.geometry import yaw_of
from onemap_shared.rates import RateMeter
from onemap_shared.services import SERVICES, doubled
from onemap_shared.trail import PointM, extended

BOUNDS_S = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 5.0)
KEPT_FRAMES = 64  # 4 s at 15 Hz: a later result is not timed
RECENT = 200  # latencies of which the quantiles are: 25 s at 8 Hz


@dataclass(frozen=True, slots=True)
class LatencyHistogram:
    """Counts per interval of ``BOUNDS_S``, the last one without an upper bound, and their sum.

    recent_s: the newest ``RECENT`` latencies, oldest first.
    """

    counts: tuple[int, ...] = (0,) * (len(BOUNDS_S) + 1)
    total_s: float = 0.0
    recent_s: tuple[float, ...] = ()

    def with_value(self, latency_s: float) -> LatencyHistogram:
        """The histogram with one more latency, seconds; a bound belongs to its own interval."""
        index = bisect_left(BOUNDS_S, latency_s)
        counts = (*self.counts[:index], self.counts[index] + 1, *self.counts[index + 1 :])
        recent_s = (*self.recent_s, latency_s)[-RECENT:]
        return LatencyHistogram(counts, self.total_s + latency_s, recent_s)

    def quantile_s(self, share: float) -> float:
        """The latency that this share of the recent ones does not exceed; 0 without any.

        The smallest such value that was measured (nearest rank), not interpolated.
        """
        ordered = sorted(self.recent_s)
        return ordered[max(ceil(share * len(ordered)), 1) - 1] if ordered else 0.0


@dataclass(frozen=True, slots=True)
class FrameLatencies:
    """Latencies per stage, and what it takes to time the next.

    arrivals: capture stamp and arrival time of the newest frames; timed_ns: the newest stamp that
    was timed of each stage, because a stage may send several messages of one frame.
    """

    arrivals: tuple[tuple[int, float], ...] = ()
    stages: Mapping[str, LatencyHistogram] = field(default_factory=dict)
    timed_ns: Mapping[str, int] = field(default_factory=dict)

    def with_frame(self, stamp_ns: int, now_s: float) -> FrameLatencies:
        """After a frame of this stamp arrived."""
        return replace(self, arrivals=(*self.arrivals, (stamp_ns, now_s))[-KEPT_FRAMES:])

    def with_result(self, stage: str, stamp_ns: int, now_s: float) -> FrameLatencies:
        """After the result of a stage arrived; unchanged if its frame is not known."""
        arrived_s = dict(self.arrivals).get(stamp_ns)
        if arrived_s is None or self.timed_ns.get(stage) == stamp_ns:
            return self
        histogram = self.stages.get(stage, LatencyHistogram())
        timed = histogram.with_value(max(now_s - arrived_s, 0.0))
        return replace(
            self,
            stages={**self.stages, stage: timed},
            timed_ns={**self.timed_ns, stage: stamp_ns},
        )


M = TypeVar("M")
BusMessage: TypeAlias = (
    m.RgbdFrame
    | m.Odometry
    | m.VelocityCommand
    | m.Detections
    | m.MapRevision
    | m.SearchStatus
    | m.PlannedPath
    | m.Heartbeat
)

STREAM_OF: Mapping[type, str] = {  # members of the state that hold the newest message
    m.RgbdFrame: "frame",
    m.Odometry: "odometry",
    m.Detections: "detections",
    m.MapRevision: "revision",
    m.SearchStatus: "search",
    m.PlannedPath: "path",
}

TRAIL_STEP_M = 0.05  # one cell: finer steps are not visible in the map image
TRAIL_JUMP_M = 1.0  # further than a robot moves between two messages: another robot or run
TRAIL_POINTS = 4000  # 200 m at TRAIL_STEP_M
DETECTIONS_MAX_AGE_S = 1.5  # older boxes would lie over another image
PATH_MAX_AGE_S = 5.0  # a planner that is silent for longer follows no path any more
HEARTBEAT_EXPIRY_S = 600.0  # after that it does not help to know when a service ended
MAX_METRICS = 128  # of one service; the planner, which has the most, has about 50
MAX_METRIC_CHARS = 100
MAX_PROBLEM_CHARS = 500
MAX_LOGGED_STATUSES = 64  # a search changes a few times a minute; readers poll at 10 Hz


@dataclass(frozen=True, slots=True)
class LatestMessage(Generic[M]):
    """The newest message of a stream, when it arrived, and the rate of the stream."""

    message: M
    arrived_s: float
    arrivals: RateMeter

    def age_s(self, now_s: float) -> float:
        """Seconds since it arrived."""
        return max(now_s - self.arrived_s, 0.0)

    def within(self, limit_s: float, now_s: float) -> M | None:
        """The message, unless it is older than ``limit_s``."""
        return self.message if self.age_s(now_s) <= limit_s else None

    def rate_hz(self, now_s: float) -> float:
        """Messages per second; falls as soon as the stream stalls."""
        return self.arrivals.rate_hz(now_s)


def newest(latest: LatestMessage[M] | None) -> M | None:
    """The message itself; None before the first."""
    return latest.message if latest else None


@dataclass(frozen=True, slots=True)
class HeartbeatRecord:
    """The newest heartbeat of a service, and when its progress counter last changed.

    started_s: when this process was first heard after its start.
    """

    heartbeat: m.Heartbeat
    arrived_s: float
    advanced_s: float
    started_s: float


@dataclass(frozen=True, slots=True)
class LiveState:
    """The latest message of every stream, and what follows from earlier ones.

    search_log: the newest statuses in order; search_count: of all statuses so far, so that a
    reader can tell which are new to it. trail_m: past positions (x, y), map frame, since the newest
    search began.
    last_fused_s: when a frame was last fused into the map. alive: services that hold a
    liveliness token; alive_changed_s: when each service's token last appeared or vanished;
    doubled: roles that several processes have, with their names. connected: whether there is a
    router. latencies: of frames to the map, to the detections and to the velocity commands.
    since_s: when the gateway began to listen.
    """

    frame: LatestMessage[m.RgbdFrame] | None = None
    odometry: LatestMessage[m.Odometry] | None = None
    detections: LatestMessage[m.Detections] | None = None
    revision: LatestMessage[m.MapRevision] | None = None
    search: LatestMessage[m.SearchStatus] | None = None
    path: LatestMessage[m.PlannedPath] | None = None
    search_log: tuple[m.SearchStatus, ...] = ()
    search_count: int = 0
    trail_m: tuple[PointM, ...] = ()
    last_fused_s: float | None = None
    heartbeats: Mapping[str, HeartbeatRecord] = field(default_factory=dict)
    alive: frozenset[str] = frozenset()
    connected: bool = True
    alive_changed_s: Mapping[str, float] = field(default_factory=dict)
    doubled: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    latencies: FrameLatencies = field(default_factory=FrameLatencies)
    since_s: float = -inf

    @property
    def robot(self) -> tuple[float, float, float] | None:
        """x, y in metres and yaw in radians, map frame; None before the first pose."""
        if self.odometry is None:
            return None
        T_map_body = self.odometry.message.T_map_body
        return float(T_map_body[0, 3]), float(T_map_body[1, 3]), yaw_of(T_map_body)

    def with_message(self, message: BusMessage, now_s: float) -> LiveState:
        """The state after ``message`` arrived."""
        changes: dict[str, Any] = {}
        if (name := STREAM_OF.get(type(message))) is not None:
            latest = getattr(self, name)
            arrivals = latest.arrivals if latest else RateMeter()
            changes[name] = LatestMessage(message, now_s, arrivals.with_event(now_s))
        timed = self.latencies.with_result
        match message:
            case m.RgbdFrame():
                changes["latencies"] = self.latencies.with_frame(message.stamp_ns, now_s)
            case m.Odometry():
                changes["trail_m"] = _trail(self.trail_m, message)
            case m.VelocityCommand() if message.frame_ns:
                changes["latencies"] = timed("command", message.frame_ns, now_s)
            case m.Detections():
                changes["latencies"] = timed("detections", message.stamp_ns, now_s)
            case m.MapRevision() if _is_progress(self.revision, message):
                changes["last_fused_s"] = now_s
                changes["latencies"] = timed("map", message.stamp_ns, now_s)
            case m.SearchStatus():
                if (before := newest(self.search)) is None or before.search_id != message.search_id:
                    changes["trail_m"] = ()
                    changes["path"] = None if before else self.path  # of the search before
                changes["search_log"] = (*self.search_log, message)[-MAX_LOGGED_STATUSES:]
                changes["search_count"] = self.search_count + 1
            case m.Heartbeat() if message.service in SERVICES:
                record = _heartbeat_record(self.heartbeats.get(message.service), message, now_s)
                changes["heartbeats"] = {**self.heartbeats, message.service: record}
        return replace(self, **changes)

    def with_members(
        self, members: frozenset[tuple[str, str]], now_s: float, *, connected: bool = True
    ) -> LiveState:
        """The state after the tokens were read: service and instance of every process.

        connected: whether the gateway has a router, without which nobody is heard.
        """
        alive = frozenset(service for service, _ in members) & SERVICES.keys()
        changed = alive ^ self.alive
        heartbeats = {
            name: record
            for name, record in self.heartbeats.items()
            if name in alive or now_s - record.arrived_s <= HEARTBEAT_EXPIRY_S
        }
        return replace(
            self,
            alive=alive,
            alive_changed_s={**self.alive_changed_s, **dict.fromkeys(changed, now_s)},
            heartbeats=heartbeats,
            doubled=doubled(members),
            connected=connected,
        )

    def detections_now(self, now_s: float) -> m.Detections | None:
        """The newest detections, unless they are older than ``DETECTIONS_MAX_AGE_S``."""
        return self.detections.within(DETECTIONS_MAX_AGE_S, now_s) if self.detections else None

    def path_now(self, now_s: float) -> m.PlannedPath | None:
        """The newest planned path, unless it is older than ``PATH_MAX_AGE_S``.

        None when the search has ended or the path is of an earlier one: nobody follows it.
        """
        if self.path is None:
            return None
        if self.search is not None:
            search = self.search.message
            if not search.active:
                return None
        return self.path.within(PATH_MAX_AGE_S, now_s)

    def statuses_since(self, count: int) -> tuple[m.SearchStatus, ...]:
        """The search statuses after the first ``count``, oldest first, as far as they are kept."""
        fresh = min(self.search_count - count, len(self.search_log))
        return self.search_log[len(self.search_log) - fresh :] if fresh > 0 else ()


def _is_progress(previous: LatestMessage[m.MapRevision] | None, message: m.MapRevision) -> bool:
    """Whether a frame was fused since the previous revision; the first one is latched.

    One of this robot: in a shared map a frame of another changes only how many there are.
    """
    if previous is None:
        return False
    before = previous.message
    another = (message.sequence, message.stamp_ns) != (before.sequence, before.stamp_ns)
    return another and message.frames_fused > before.frames_fused


def _heartbeat_record(
    previous: HeartbeatRecord | None, heartbeat: m.Heartbeat, now_s: float
) -> HeartbeatRecord:
    advanced_s = started_s = now_s
    if previous is not None and previous.heartbeat.instance == heartbeat.instance:
        if previous.heartbeat.progress == heartbeat.progress:
            advanced_s = previous.advanced_s
        if not previous.heartbeat.starting:
            started_s = previous.started_s
    return HeartbeatRecord(_bounded(heartbeat), now_s, advanced_s, started_s)


def _bounded(heartbeat: m.Heartbeat) -> m.Heartbeat:
    """The heartbeat as far as it is shown: finite metrics, few and short ones."""
    metrics = {
        name: value
        for name, value in islice(heartbeat.metrics.items(), MAX_METRICS)
        if isfinite(value) and len(name) <= MAX_METRIC_CHARS
    }
    return replace(heartbeat, metrics=metrics, problem=heartbeat.problem[:MAX_PROBLEM_CHARS])


def _trail(trail: tuple[PointM, ...], odometry: m.Odometry) -> tuple[PointM, ...]:
    xy = (float(odometry.T_map_body[0, 3]), float(odometry.T_map_body[1, 3]))
    return extended(trail, xy, step_m=TRAIL_STEP_M, max_points=TRAIL_POINTS, jump_m=TRAIL_JUMP_M)
