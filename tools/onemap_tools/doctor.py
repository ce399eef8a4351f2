"""``onemap doctor``: observe the bus for a few seconds and say what is wrong, in sentences."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from datetime import datetime, timezone
from enum import Enum
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from rich.console import Console
from rich.text import Text

from onemap_shared import keys
from onemap_shared.config import BusConfig, read, section
from onemap_shared.geometry import U16
from onemap_shared.messages import Heartbeat, MapRevision, TextRequest
from onemap_shared.services import doubled, doubled_sentence, role_of
from onemap_shared.tls_files import IN_ENDPOINT
from onemap_shared.transport import Bus, CallError, Counters
from onemap_tools.processes.services import CORE
from onemap_tools.processes.session import temporary_session

M = TypeVar("M")

CONNECT_S = 3.0
LISTEN_S = 3.5  # three heartbeats of every service
POLL_S = 0.02
QUEUE = 64  # messages held between two polls
NEAR_M = 0.1  # below the range of depth cameras: nearer values are a wrong depth scale
FAR_M = 20.0  # larger than any room: a greater median is a wrong depth scale
NO_RETURN_FRACTION = 0.9  # above, too few pixels have depth to map anything
CLOCK_TOLERANCE_S = 0.3  # above the latency of transport and processing; NTP holds 0.05 s
OLD_S = 2.0  # the robot has driven a metre or more since
FEW_DISORDERED = 3  # one or two: the publisher was started again
FEW_FRAMES = 5  # fewer fused frames may all show the same view
STANDING = 0.02  # m/s or rad/s; below it the robot stands still
# Of processes that say what they lack, instead of their log.
REMEDIES = {"ros2": "See what the robot has: onemap ros2 topics, with the same --config."}


@dataclass(frozen=True, slots=True)
class ObservedStream:
    """A topic and who publishes it; age_s: local clock minus the stamp of the newest message."""

    name: str
    source: str
    counters: Counters
    age_s: float | None = None


@dataclass(frozen=True, slots=True)
class ObservedProcess:
    """The first and the last heartbeat of a process.

    clock_offset_s: its clock minus the local one, less the transport's latency.
    """

    first: Heartbeat
    last: Heartbeat
    clock_offset_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Observations:
    """Everything that was received in ``duration_s`` seconds.

    alive: services with a connected process. doubled: roles that several processes have, with
    their names. depth_mm: (H, W) of the newest frame. revisions: the first and the last.
    encoders: of features, map and texts, each its id and text space. commanded, driven: the
    largest of speeds (m/s) and turns (rad/s). robot_clock_s: the robot's stamps minus the local
    clock, less the transport's latency; None without a message of it.
    """

    duration_s: float
    alive: frozenset[str] = frozenset()
    doubled: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    streams: tuple[ObservedStream, ...] = ()
    processes: tuple[ObservedProcess, ...] = ()
    depth_mm: U16 | None = None
    revisions: tuple[MapRevision, MapRevision] | None = None
    encoders: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    commanded: float = 0.0
    driven: float = 0.0
    collided: bool = False
    robot_clock_s: float | None = None


class _Inbox(Generic[M]):
    """The messages of one topic, each with its age in seconds when it was taken.

    source: who publishes it. large: only the newest message is kept.
    """

    def __init__(
        self, bus: Bus, topic: keys.Topic[M], source: str = "", *, large: bool = False
    ) -> None:
        self._key, self._source = topic.key, source
        self._subscription = bus.subscribe(topic, 1 if large else QUEUE)
        self._dated: deque[tuple[M, float | None]] = deque(maxlen=1 if large else None)

    def poll(self) -> None:
        while (message := self._subscription.take(0.0)) is not None:
            stamp_ns = getattr(message, "stamp_ns", 0)  # 0: of a map before its first frame
            age_s = (time.time_ns() - stamp_ns) / 1e9 if stamp_ns else None
            self._dated.append((message, age_s))

    @property
    def messages(self) -> list[M]:
        return [message for message, _ in self._dated]

    @property
    def ages_s(self) -> list[float | None]:
        return [age_s for _, age_s in self._dated]

    @property
    def stream(self) -> ObservedStream:
        age_s = self._dated[-1][1] if self._dated else None
        return ObservedStream(self._key, self._source, self._subscription.counters, age_s)


class BusObserver:
    """Subscribes to every topic that the checks need; ``poll`` it several times a second."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._rgbd = _Inbox(bus, keys.ROBOT_RGBD, "robot", large=True)
        self._odometry = _Inbox(bus, keys.ROBOT_ODOMETRY, "robot")
        self._field = _Inbox(bus, keys.FIELD, "perception", large=True)
        self._revisions = _Inbox(bus, keys.MAP_REVISION, "mapper")
        self._commands = _Inbox(bus, keys.ROBOT_CMD_VEL)
        self._beats = _Inbox(bus, keys.ALL_HEARTBEATS)
        self._streams: tuple[_Inbox[Any], ...] = (
            self._rgbd,
            self._odometry,
            self._field,
            self._revisions,
        )

    def poll(self) -> None:
        """Take all queued messages of all topics."""
        for inbox in (*self._streams, self._commands, self._beats):
            inbox.poll()

    def observations(self, duration_s: float) -> Observations:
        """The observations so far, made in ``duration_s`` seconds."""
        driven, revisions = self._odometry.messages, self._revisions.messages
        speeds = [(o.linear_mps, o.lateral_mps, o.angular_radps) for o in driven]
        wanted = [(c.velocity.speed_mps, c.angular_radps) for c in self._commands.messages]
        rgbd = self._rgbd.messages
        return Observations(
            duration_s=duration_s,
            alive=self._bus.alive(),
            doubled=doubled(self._bus.members()),
            streams=tuple(inbox.stream for inbox in self._streams),
            processes=self._processes(),
            depth_mm=rgbd[-1].depth_mm if rgbd else None,
            revisions=(revisions[0], revisions[-1]) if revisions else None,
            encoders=self._encoders(),
            commanded=max((abs(v) for each in wanted for v in each), default=0.0),
            driven=max((abs(v) for each in speeds for v in each), default=0.0),
            collided=any(odometry.collided for odometry in driven),
            robot_clock_s=self._robot_clock_s(),
        )

    def _robot_clock_s(self) -> float | None:
        """By its youngest message: latency only makes them older."""
        ages_s = [
            age_s for age_s in self._odometry.ages_s or self._rgbd.ages_s if age_s is not None
        ]
        return -min(ages_s) if ages_s else None

    def _processes(self) -> tuple[ObservedProcess, ...]:
        """The largest offset of a clock is the best estimate: latency only makes it smaller."""
        found: dict[str, ObservedProcess] = {}
        for beat, age_s in zip(self._beats.messages, self._beats.ages_s, strict=True):
            offset_s = -(age_s or 0.0)
            before = found.get(beat.instance, ObservedProcess(beat, beat, offset_s))
            offset_s = max(before.clock_offset_s, offset_s)
            found[beat.instance] = ObservedProcess(before.first, beat, offset_s)
        return tuple(found.values())

    def _encoders(self) -> dict[str, tuple[str, str]]:
        found: dict[str, Any] = {"camera features": self._field, "the map": self._revisions}
        newest = {what: inbox.messages[-1] for what, inbox in found.items() if inbox.messages}
        with suppress(CallError):
            newest["texts"] = self._bus.call(keys.EMBED_TEXT, TextRequest(("sofa",)))
        return {what: (each.encoder_id, each.text_space) for what, each in newest.items()}


def observe(bus: Bus, duration_s: float) -> Observations:
    """Observe the bus for ``duration_s`` seconds."""
    observer = BusObserver(bus)
    end_s = time.monotonic() + duration_s
    while time.monotonic() < end_s:
        observer.poll()
        time.sleep(POLL_S)
    return observer.observations(duration_s)


class Severity(str, Enum):
    """An error keeps objects from being found, a warning may, a note does not."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True, slots=True)
class Finding:
    """One fault and its remedy."""

    severity: Severity
    sentence: str
    remedy: str


def _error(sentence: str, remedy: str) -> Finding:
    return Finding(Severity.ERROR, sentence, remedy)


def _warning(sentence: str, remedy: str) -> Finding:
    return Finding(Severity.WARNING, sentence, remedy)


def _services(observed: Observations) -> Iterator[Finding]:
    """Services that do not run, hang, are not ready or run twice."""
    for name in CORE:
        if name not in observed.alive:
            yield _absent(name, observed)
    for role, names in observed.doubled.items():
        yield _error(
            f"{doubled_sentence(role, names)}.",
            "Stop all but one of them, or give each robot a bus.namespace of its own.",
        )
    for name in sorted({process.last.service for process in observed.processes}):
        processes = [process for process in observed.processes if process.last.service == name]
        if len(processes) > 1 and role_of(name) not in observed.doubled:
            yield _error(
                f"{len(processes)} processes say that they are the {name}: their messages mix.",
                "Stop all but one of them.",
            )
        for process in processes:
            yield from _unhealthy(process)


def _absent(name: str, observed: Observations) -> Finding:
    """A service that is not connected: it ended, or it hangs by the gateway's metrics."""
    silent_s = _metrics_with(f"hung_{name}_s", observed).get(f"hung_{name}_s")
    if silent_s is None:
        return _error(
            f"The {name} is not running.",
            f"Start it: onemap service {name}, with the same --config; what 'onemap up' began it "
            "starts again.",
        )
    return _error(
        f"The {name} has not been heard for {silent_s:.0f} s: its process hangs or its link is "
        "down.",
        "Restart it rather than start a second one; look at its log first.",
    )


def _metrics_with(name: str, observed: Observations) -> Mapping[str, float]:
    """The metrics of the first process that reports this one; empty if none does."""
    reported = (process.last.metrics for process in observed.processes)
    return next((metrics for metrics in reported if name in metrics), {})


def _unhealthy(process: ObservedProcess) -> Iterator[Finding]:
    first, last = process.first, process.last
    problem = last.problem.rstrip(".")
    if first is not last and last.progress <= first.progress:
        yield _error(
            f"The {last.service} runs but its main loop stands still.",
            "Look at its log, then restart it.",
        )
    elif problem or not last.ready:
        make = _warning if last.ready else _error
        yield make(
            f"The {last.service} is not well: {problem or 'it does not say why'}.",
            REMEDIES.get(last.service, "Look at its log."),
        )


def _streams(observed: Observations) -> Iterator[Finding]:
    """Streams without messages, with old messages or with messages that cannot be decoded."""
    for stream in observed.streams:
        name, source, counters = stream.name, stream.source, stream.counters
        if counters.received == 0 and counters.refused == 0:
            yield _error(
                f"Nothing arrives on {name} from the {source}.",
                f"See whether the {source} runs, and under the same bus namespace.",
            )
        if counters.refused:
            yield _error(
                f"{counters.refused} messages on {name} could not be read, the last "
                f"because: {counters.last_problem}.",
                f"Send it as docs/messages.md describes; if the {source} is OneMap's "
                "own, run the same version there and here.",
            )
        # The mapper announces a map again, with the same frame, when a layer is reset.
        if source != "mapper" and counters.disordered >= FEW_DISORDERED:
            yield _error(
                f"{counters.disordered} of {counters.received} messages on {name} have no "
                "higher number than the one before: several processes send them.",
                f"Run one {source} on these keys; its driver must count its messages.",
            )
        late_s = (stream.age_s or 0.0) + (observed.robot_clock_s or 0.0)
        if stream.age_s is not None and late_s > OLD_S:
            yield _error(
                f"What arrives on {name} is {late_s:.1f} s older than what the robot says now.",
                f"The {source} is too slow: see its metrics with 'onemap status'.",
            )


def _clocks(observed: Observations) -> Iterator[Finding]:
    """Clocks that disagree, which nothing but what people compare depends on."""
    clocks = {f"the {p.last.service}'s": p.clock_offset_s for p in observed.processes}
    if observed.robot_clock_s is not None:
        clocks["the robot's"] = observed.robot_clock_s
    other = {whose: by_s for whose, by_s in clocks.items() if abs(by_s) > CLOCK_TOLERANCE_S}
    if other:
        yield Finding(
            Severity.NOTE,
            "Clocks differ from this machine's: "
            + ", ".join(f"{whose} by {by_s:+.1f} s" for whose, by_s in other.items())
            + ".",
            "Nothing stops for it. Times in logs and onemap_perception_frame_age_ms compare only "
            "with one clock (chrony or NTP).",
        )


def _depth(observed: Observations) -> Iterator[Finding]:
    """A depth image without returns or in another unit than millimetres."""
    if observed.depth_mm is None:
        return
    returns_m = observed.depth_mm[observed.depth_mm > 0] / 1000
    valid = returns_m.size / observed.depth_mm.size
    if valid < 1 - NO_RETURN_FRACTION:
        yield _error(
            f"Only {valid:.0%} of the depth pixels hold a return.",
            "Check that the depth stream is on, aligned to colour, and not covered.",
        )
    elif np.mean(returns_m < NEAR_M) > 0.5:
        yield _error(
            f"Most depth is nearer than {NEAR_M * 100:.0f} cm.",
            "Depth must be in millimetres: metres or raw units were sent, or the lens is covered.",
        )
    elif (median_m := np.median(returns_m)) > FAR_M:
        yield _error(
            f"The median depth is {median_m:.0f} m, more than any room.",
            "Depth must be in millimetres: a finer unit (0.1 mm) was sent.",
        )


def _floor(observed: Observations) -> Iterator[Finding]:
    """Extrinsics by which the floor is not at z = 0, from the mapper's metrics."""
    mapper = _metrics_with("floor_viewpoints", observed)
    if not mapper:
        return
    viewpoints = f"{mapper['floor_viewpoints']:.0f} viewpoints"
    if "floor_wrong" not in mapper:
        yield Finding(
            Severity.NOTE,
            f"The mapper cannot tell yet whether the floor lies at z = 0, from {viewpoints}.",
            "Drive or turn the robot: the lowest surface in one view may be a table.",
        )
    elif mapper["floor_wrong"]:
        yield _error(
            f"The mapper sees the floor at z = {mapper['floor_height_m']:.2f} m, tilted by "
            f"{mapper['floor_tilt_deg']:.1f} degrees, from {viewpoints}.",
            "Check T_map_camera: camera frame x right, y down, z forward; map z up, floor at "
            "z = 0.",
        )


def _encoders(observed: Observations) -> Iterator[Finding]:
    """Features, map and texts of different encoders."""
    known = {what: encoder for what, encoder in observed.encoders.items() if any(encoder)}
    if len(set(known.values())) > 1:
        parts = ", ".join(f"{what} from {encoder[0]!r}" for what, encoder in known.items())
        yield _error(
            f"Encoders differ: {parts}.",
            "Clear the map ('onemap map clear') or load one that was made with this encoder.",
        )


def _map(observed: Observations) -> Iterator[Finding]:
    """A map that receives no frames, stays empty or does not grow."""
    if observed.revisions is None:
        return
    first, last = observed.revisions
    if last.frames_fused == first.frames_fused:
        yield _error(
            f"No frame reached the map in {observed.duration_s:.0f} s.",
            "Follow the frames: robot, perception, mapper; the first silent one is it.",
        )
    elif last.cells_observed == 0 and last.frames_fused >= FEW_FRAMES:
        yield _error(
            f"{last.frames_fused} frames were fused and the map is still empty.",
            "All points are out of the mapper's height or depth range: check extrinsics and depth "
            "scale.",
        )
    elif last.cells_observed == first.cells_observed and observed.driven > STANDING:
        yield _warning(
            "The robot drives and the map does not grow.",
            "Fine where all is mapped already; otherwise check that the pose changes too.",
        )


def _driving(observed: Observations) -> Iterator[Finding]:
    """A robot that does not follow commands, or that has collided."""
    if observed.commanded > STANDING and observed.driven <= STANDING:
        yield _error(
            "The planner commands motion and the robot stands still.",
            "Release the emergency stop; see that the robot's driver obeys the velocity topic.",
        )
    if observed.collided:
        yield _warning(
            "The robot touches an obstacle.",
            "Give the planner the robot's true radius; it backs off by itself.",
        )


CHECKS = (_services, _streams, _clocks, _depth, _floor, _encoders, _map, _driving)


def diagnose(observed: Observations) -> list[Finding]:
    """All findings: errors, warnings, notes; each sentence once."""
    findings = {f.sentence: f for check in CHECKS for f in check(observed)}
    order = list(Severity)
    return sorted(findings.values(), key=lambda finding: order.index(finding.severity))


COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.NOTE: "dim"}


def examine(config: Path | None, console: Console) -> list[Finding]:
    """Observe the bus of this configuration for ``LISTEN_S`` and diagnose."""
    bus_config = section(read(config), "bus", BusConfig)
    ending = certificates_that_end(bus_config, datetime.now(timezone.utc))
    if not healthy(ending):  # nothing would answer
        return ending
    with temporary_session(bus_config, "doctor", CONNECT_S) as bus:
        console.print(f"Listening for {LISTEN_S:g} s ...", style="dim")
        return [*ending, *diagnose(observe(bus, LISTEN_S))]


def certificates_that_end(config: BusConfig, now: datetime) -> list[Finding]:
    """Findings about the certificates of a bus; none where the extra ``certs`` is not there."""
    try:
        from onemap_tools.certificates import ending
    except ImportError:
        return []
    files = [name for endpoint in config.connect for name in IN_ENDPOINT.findall(endpoint)]
    remedy = "Make new ones with 'onemap certs' and give them to the machines."
    return [
        (_error if ends <= now else _warning)(
            f"The certificate {name} {'ended' if ends <= now else 'ends'} on {ends:%Y-%m-%d}.",
            remedy,
        )
        for name, ends in ending(files, now).items()
    ]


def describe(findings: list[Finding], console: Console) -> None:
    """Print each finding with its remedy."""
    for finding in findings:
        severity = Text(finding.severity.value, style=COLOURS[finding.severity])
        console.print(severity, Text(f"{finding.sentence} {finding.remedy}"))
    if all(finding.severity is Severity.NOTE for finding in findings):
        console.print("Nothing is wrong that can be seen from here.")


def healthy(findings: list[Finding]) -> bool:
    """Whether there is no error; warnings and notes are allowed."""
    return all(finding.severity is not Severity.ERROR for finding in findings)


def document(findings: list[Finding]) -> dict[str, Any]:
    """The findings as a JSON object."""
    return {"healthy": healthy(findings), "findings": [asdict(each) for each in findings]}
