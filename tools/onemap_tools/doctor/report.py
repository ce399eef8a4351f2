"""Runs ``onemap doctor``: observe the bus for a few seconds, diagnose, print the findings."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from rich.console import Console
from rich.text import Text

from onemap_shared import keys
from onemap_shared.config import BusConfig, read, section
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
from onemap_shared.services import doubled
from onemap_shared.transport import Bus, CallError
from onemap_tools.doctor.checks import (
    NEAR_M,
    DepthStatistics,
    Finding,
    MapGrowth,
    MotionSummary,
    Observations,
    ProcessHealth,
    Severity,
    StreamStatus,
    diagnose,
)
from onemap_tools.processes.session import temporary_session

M = TypeVar("M")

QUEUE = 64  # messages held between two polls
POLL_S = 0.02


class TopicObserver(Generic[M]):
    """Counts the messages of one topic and keeps the newest."""

    def __init__(
        self,
        bus: Bus,
        topic: keys.Topic[M],
        on_message: Callable[[M], None] = lambda _: None,
        capacity: int = QUEUE,
    ) -> None:
        self._topic = topic
        self._subscription = bus.subscribe(topic, capacity)
        self._on_message = on_message
        self._age_s: float | None = None
        self.newest: M | None = None

    def poll(self) -> None:
        """Take all queued messages."""
        while (message := self._subscription.take(0.0)) is not None:
            self.newest = message
            stamp_ns = getattr(message, "stamp_ns", 0)
            self._age_s = (time.time_ns() - stamp_ns) / 1e9 if stamp_ns else None
            self._on_message(message)

    def stream(self, source: str) -> StreamStatus:
        """Counters of the topic; ``source`` is the process that publishes it."""
        counters = self._subscription.counters
        return StreamStatus(
            name=self._topic.key,
            source=source,
            count=counters.received,
            age_s=self._age_s,
            refused=counters.refused,
            last_problem=counters.last_problem,
            disordered=counters.disordered,
        )


class BusObserver:
    """Subscribes to every topic that the checks need."""

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
        self._observers: tuple[TopicObserver[Any], ...] = (
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
        speed = max(command.velocity.speed_mps, abs(command.angular_radps))
        self._commanded = max(self._commanded, speed)

    def _on_odometry(self, odometry: Odometry) -> None:
        speed = max(abs(odometry.linear_mps), abs(odometry.lateral_mps))
        speed = max(speed, abs(odometry.angular_radps))
        self._driven = max(self._driven, speed)
        self._collided |= odometry.collided

    def poll(self) -> None:
        """Take all queued messages of all topics."""
        for observer in self._observers:
            observer.poll()

    def observations(self, duration_s: float) -> Observations:
        """The observations so far, made in ``duration_s`` seconds."""
        field = self._field.newest
        return Observations(
            duration_s=duration_s,
            alive=self._bus.alive(),
            doubled=doubled(self._bus.members()),
            streams=(
                self._rgbd.stream("robot"),
                self._odometry.stream("robot"),
                self._field.stream("perception"),
                self._revision.stream("mapper"),
            ),
            processes=tuple(process_health(beats) for beats in self._beats.values()),
            depth=depth_statistics(self._rgbd.newest) if self._rgbd.newest else None,
            map=map_growth(self._revisions),
            field_encoder=(field.encoder_id, field.text_space) if field else None,
            text_encoder=self._text_encoder(),
            motion=MotionSummary(self._commanded, self._driven, self._collided),
        )

    def _text_encoder(self) -> tuple[str, str] | None:
        try:
            reply = self._bus.call(keys.EMBED_TEXT, TextRequest(("sofa",)))
        except CallError:
            return None
        return (reply.encoder_id, reply.text_space)


def observe(bus: Bus, duration_s: float) -> Observations:
    """Observe the bus for ``duration_s`` seconds."""
    observer = BusObserver(bus)
    end_s = time.monotonic() + duration_s
    while time.monotonic() < end_s:
        observer.poll()
        time.sleep(POLL_S)
    return observer.observations(duration_s)


def process_health(beats: list[tuple[Heartbeat, float]]) -> ProcessHealth:
    """Health of one process from its heartbeats, each with its clock offset on arrival.

    The largest offset is the best estimate: latency only makes it smaller.
    """
    first, last = beats[0][0], beats[-1][0]
    return ProcessHealth(
        service=last.service,
        instance=last.instance,
        ready=last.ready,
        problem=last.problem.rstrip("."),
        clock_offset_s=max(offset_s for _, offset_s in beats),
        advanced=len(beats) < 2 or last.progress > first.progress,
        metrics=last.metrics,
    )


def depth_statistics(frame: RgbdFrame) -> DepthStatistics:
    """Fraction of returns, their median and the fraction that is too near."""
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
    """The change of the map between the first and the last revision; None without revisions."""
    if not revisions:
        return None
    first, last = revisions[0], revisions[-1]
    return MapGrowth(
        frames=(first.frames_fused, last.frames_fused),
        cells=(first.cells_observed, last.cells_observed),
        encoder_id=last.encoder_id,
        text_space=last.text_space,
    )


CONNECT_S = 3.0
LISTEN_S = 3.5  # three heartbeats of every service
COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.NOTE: "dim"}


def examine(config: Path | None, console: Console) -> list[Finding]:
    """Observe the bus of this configuration for ``LISTEN_S`` and diagnose."""
    with temporary_session(section(read(config), "bus", BusConfig), "doctor", CONNECT_S) as bus:
        console.print(f"Listening for {LISTEN_S:g} s ...", style="dim")
        return diagnose(observe(bus, LISTEN_S))


def describe(findings: list[Finding], console: Console) -> None:
    """Print each finding with its remedy."""
    for finding in findings:
        severity = Text(str(finding.severity), style=COLOURS[finding.severity])
        console.print(severity, Text(f"{finding.sentence} {finding.remedy}"))
    if all(finding.severity is Severity.NOTE for finding in findings):
        console.print("Nothing is wrong that can be seen from here.")


def healthy(findings: list[Finding]) -> bool:
    """Whether there is no error; warnings and notes are allowed."""
    return all(finding.severity is not Severity.ERROR for finding in findings)


def document(findings: list[Finding]) -> dict[str, Any]:
    """The findings as a JSON object."""
    return {
        "healthy": healthy(findings),
        "findings": [
            {"severity": str(f.severity), "sentence": f.sentence, "remedy": f.remedy}
            for f in findings
        ],
    }
