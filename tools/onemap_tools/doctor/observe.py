"""What a doctor hears on the bus in a few seconds, in numbers that checks can judge."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Generic, TypeVar

import numpy as np

from onemap_shared import keys
from onemap_shared.geometry import F32
from onemap_shared.messages import (
    FeatureField,
    Heartbeat,
    MapRevision,
    Odometry,
    RgbdFrame,
    TextRequest,
    VelocityCommand,
)
from onemap_shared.transport import Bus, CallError
from onemap_tools.doctor.observations import (
    NEAR_M,
    DepthStatistics,
    MapGrowth,
    MotionSummary,
    Observations,
    ProcessHealth,
    StreamStatus,
)

M = TypeVar("M")

KEPT = 64  # messages kept between two looks; looks are 20 ms apart
POLL_S = 0.02


class TopicObserver(Generic[M]):
    """A topic whose messages are counted and whose newest is kept."""

    def __init__(
        self,
        bus: Bus,
        topic: keys.Topic[M],
        on_message: Callable[[M], None] = lambda _: None,
        capacity: int = KEPT,
    ) -> None:
        self._topic = topic
        self._subscription = bus.subscribe(topic, capacity)
        self._on_message = on_message
        self._age_s: float | None = None
        self.newest: M | None = None

    def poll(self) -> None:
        """Take what lies ready."""
        while (message := self._subscription.take(0.0)) is not None:
            self.newest = message
            stamp_ns = getattr(message, "stamp_ns", 0)
            self._age_s = (time.time_ns() - stamp_ns) / 1e9 if stamp_ns else None
            self._on_message(message)

    def stream(self, source: str) -> StreamStatus:
        """What there is to say of the topic."""
        counters = self._subscription.counters
        return StreamStatus(
            name=self._topic.key,
            source=source,
            count=counters.received,
            age_s=self._age_s,
            refused=counters.refused,
            last_problem=counters.last_problem,
        )


class BusObserver:
    """Listens to everything that a diagnosis needs."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._commanded = self._driven = 0.0
        self._collided = False
        self._beats: dict[str, list[tuple[Heartbeat, float]]] = {}
        self._revisions: list[MapRevision] = []
        self._rgbd: TopicObserver[RgbdFrame] = TopicObserver(bus, keys.ROBOT_RGBD, capacity=1)
        self._field: TopicObserver[FeatureField] = TopicObserver(bus, keys.FIELD, capacity=1)
        self._odometry = TopicObserver(bus, keys.ROBOT_ODOMETRY, self._on_odometry)
        self._revision = TopicObserver(bus, keys.MAP_REVISION, self._revisions.append)
        self._listeners: tuple[TopicObserver[Any], ...] = (
            self._rgbd,
            self._field,
            self._odometry,
            self._revision,
            TopicObserver(bus, keys.ROBOT_CMD_VEL, self._on_command),
            TopicObserver(bus, keys.ALL_HEARTBEATS, self._on_beat),
        )

    def _on_beat(self, beat: Heartbeat) -> None:
        offset_s = (beat.stamp_ns - time.time_ns()) / 1e9
        self._beats.setdefault(beat.instance, []).append((beat, offset_s))

    def _on_command(self, command: VelocityCommand) -> None:
        speed = max(abs(command.linear_mps), abs(command.angular_radps))
        self._commanded = max(self._commanded, speed)

    def _on_odometry(self, odometry: Odometry) -> None:
        speed = max(abs(odometry.linear_mps), abs(odometry.angular_radps))
        self._driven = max(self._driven, speed)
        self._collided |= odometry.collided

    def poll(self) -> None:
        """Take in what lies ready."""
        for listener in self._listeners:
            listener.poll()

    def observations(self, duration_s: float) -> Observations:
        """What was heard so far, in ``duration_s``."""
        field = self._field.newest
        return Observations(
            duration_s=duration_s,
            alive=self._bus.alive(),
            streams=(
                self._rgbd.stream("robot"),
                self._odometry.stream("robot"),
                self._field.stream("perception"),
                self._revision.stream("mapper"),
            ),
            processes=tuple(process_health(heard) for heard in self._beats.values()),
            depth=depth_statistics(self._rgbd.newest) if self._rgbd.newest else None,
            map=map_growth(self._revisions),
            field_encoder=(field.encoder_id, field.text_space) if field else None,
            text_encoder=self._ask_for_text_encoder(),
            motion=MotionSummary(self._commanded, self._driven, self._collided),
        )

    def _ask_for_text_encoder(self) -> tuple[str, str] | None:
        try:
            reply = self._bus.call(keys.EMBED_TEXT, TextRequest(("sofa",)))
        except CallError:
            return None
        return (reply.encoder_id, reply.text_space)


def observe(bus: Bus, duration_s: float) -> Observations:
    """Listen to everything for ``duration_s``."""
    observer = BusObserver(bus)
    end_s = time.monotonic() + duration_s
    while time.monotonic() < end_s:
        observer.poll()
        time.sleep(POLL_S)
    return observer.observations(duration_s)


def process_health(heard: list[tuple[Heartbeat, float]]) -> ProcessHealth:
    """One process from its heartbeats, each with its clock's lead over ours at arrival.

    The largest lead is nearest to the truth: the way here only ever makes it smaller.
    """
    first, last = heard[0][0], heard[-1][0]
    return ProcessHealth(
        service=last.service,
        instance=last.instance,
        ready=last.ready,
        problem=last.problem.rstrip("."),
        clock_offset_s=max(offset_s for _, offset_s in heard),
        advanced=len(heard) < 2 or last.progress > first.progress,
        metrics=last.metrics,
    )


def depth_statistics(frame: RgbdFrame) -> DepthStatistics:
    """The depth image of a frame in numbers."""
    depth_m: F32 = (frame.depth_mm / np.float32(1000)).astype(np.float32)
    valid = depth_m > 0
    if not valid.any():
        nan = float("nan")
        return DepthStatistics(0.0, nan, 0.0)
    returns_m = depth_m[valid]
    return DepthStatistics(
        valid=float(valid.mean()),
        median_m=float(np.median(returns_m)),
        near=float((returns_m < NEAR_M).mean()),
    )


def map_growth(revisions: list[MapRevision]) -> MapGrowth | None:
    """How the map changed between the first and the last revision heard."""
    if not revisions:
        return None
    first, last = revisions[0], revisions[-1]
    return MapGrowth(
        frames=(first.frames_fused, last.frames_fused),
        cells=(first.cells_observed, last.cells_observed),
        encoder_id=last.encoder_id,
        text_space=last.text_space,
    )
