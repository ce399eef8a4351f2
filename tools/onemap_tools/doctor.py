"""``onemap doctor``: what ``/v1/status`` says is wrong, and what a listener on the bus can tell.

Without a gateway the doctor judges the services itself, by the gateway's own function.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from datetime import datetime, timezone
from enum import Enum
from pathlib import Path
from typing import Any, Generic, TypeVar

from rich.console import Console
from rich.text import Text

from onemap import Client, OneMapError
from onemap.replies import ServiceHealth
from onemap_gateway.bus.live_state import LiveState
from onemap_gateway.present.service_status import DOWN, OK, assess_service, assess_services
from onemap_shared import keys
from onemap_shared.config import BusConfig, read, section
from onemap_shared.messages import MapRevision
from onemap_shared.tls_files import IN_ENDPOINT
from onemap_shared.transport import Bus, Counters
from onemap_tools.processes.network import DEFAULT_PORT, LOOPBACK
from onemap_tools.processes.session import temporary_session

M = TypeVar("M")

CONNECT_S = 3.0
LISTEN_S = 3.5  # three heartbeats of every service
ALONE_S = 6.0  # the same without a gateway: longer than a loop may stand still
POLL_S = 0.02
QUEUE = 64  # messages held between two polls
CLOCK_TOLERANCE_S = 0.3  # above the latency of transport and processing; NTP holds 0.05 s
OLD_S = 2.0  # the robot has driven a metre or more since
FEW_DISORDERED = 3  # one or two: the publisher was started again
FEW_FRAMES = 5  # fewer fused frames may all show the same view
STANDING = 0.02  # m/s or rad/s; below it the robot stands still
ROBOT = "robot"


@dataclass(frozen=True, slots=True)
class ObservedStream:
    """A topic and who publishes it; age_s: local clock minus the stamp of the newest message."""

    name: str
    source: str
    counters: Counters
    age_s: float | None = None


@dataclass(frozen=True, slots=True)
class Observations:
    """What was seen.

    services: as ``/v1/status`` has them. clocks_s: of services and robot, minus the local one, less
    the transport's latency. revision: of the map, the newest. commanded, driven: the largest of
    speeds (m/s) and turns (rad/s).
    """

    services: tuple[ServiceHealth, ...] = ()
    streams: tuple[ObservedStream, ...] = ()
    clocks_s: Mapping[str, float] = field(default_factory=dict)
    revision: MapRevision | None = None
    commanded: float = 0.0
    driven: float = 0.0
    collided: bool = False

    def is_well(self, service: str) -> bool:
        """Whether nothing is wrong with a service as far as it is known."""
        return all(each.condition == OK for each in self.services if each.name == service)


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

    def poll(self) -> Iterator[M]:
        """The messages that came since."""
        while (message := self._subscription.take(0.0)) is not None:
            stamp_ns = getattr(message, "stamp_ns", 0)  # 0: of a map before its first frame
            age_s = (time.time_ns() - stamp_ns) / 1e9 if stamp_ns else None
            self._dated.append((message, age_s))
            yield message

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
        self._rgbd = _Inbox(bus, keys.ROBOT_RGBD, ROBOT, large=True)
        self._odometry = _Inbox(bus, keys.ROBOT_ODOMETRY, ROBOT)
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
        self._state = LiveState()

    def poll(self) -> None:
        """Take all queued messages of all topics, and see who is connected."""
        self._state = self._state.with_members(self._bus.members(), time.monotonic())
        for inbox in (*self._streams, self._commands, self._beats):
            for message in inbox.poll():
                self._state = self._state.with_message(message, time.monotonic())

    def services(self) -> tuple[ServiceHealth, ...]:
        """As the gateway would say now."""
        now_s = time.monotonic()
        found = assess_services(self._state, now_s)
        if all(each.name != "gateway" for each in found):
            found.append(assess_service("gateway", self._state, now_s))
        return tuple(found)

    def observations(self, services: tuple[ServiceHealth, ...] | None = None) -> Observations:
        """The observations so far, with the gateway's services."""
        driven, revisions = self._odometry.messages, self._revisions.messages
        speeds = [(o.linear_mps, o.lateral_mps, o.angular_radps) for o in driven]
        wanted = [(c.velocity.speed_mps, c.angular_radps) for c in self._commands.messages]
        return Observations(
            services=self.services() if services is None else services,
            streams=tuple(inbox.stream for inbox in self._streams),
            clocks_s=self._clocks_s(),
            revision=revisions[-1] if revisions else None,
            commanded=max((abs(v) for each in wanted for v in each), default=0.0),
            driven=max((abs(v) for each in speeds for v in each), default=0.0),
            collided=any(odometry.collided for odometry in driven),
        )

    def _clocks_s(self) -> dict[str, float]:
        """By the youngest message of each: latency only makes them older."""
        robot = self._odometry if self._odometry.messages else self._rgbd
        dated = [(ROBOT, age_s) for age_s in robot.ages_s]
        services = (beat.service for beat in self._beats.messages)
        dated += zip(services, self._beats.ages_s, strict=True)
        clocks_s: dict[str, float] = {}
        for whose, age_s in dated:
            if age_s is not None:
                clocks_s[whose] = max(clocks_s.get(whose, -age_s), -age_s)
        return clocks_s


def observe(
    bus: Bus, duration_s: float, services: tuple[ServiceHealth, ...] | None = None
) -> Observations:
    """Observe the bus for ``duration_s`` seconds."""
    observer = BusObserver(bus)
    end_s = time.monotonic() + duration_s
    while time.monotonic() < end_s:
        observer.poll()
        time.sleep(POLL_S)
    return observer.observations(services)


class Severity(str, Enum):
    """An error keeps objects from being found, a warning may, a note does not."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True, slots=True)
class Finding:
    """What is wrong, and what to do about it."""

    severity: Severity
    sentence: str


def _error(sentence: str) -> Finding:
    return Finding(Severity.ERROR, sentence)


def _warning(sentence: str) -> Finding:
    return Finding(Severity.WARNING, sentence)


def _services(observed: Observations) -> Iterator[Finding]:
    """What ``/v1/status`` says."""
    for each in observed.services:
        if each.condition != OK:
            wrong = _warning if each.ready and each.condition != DOWN else _error
            yield wrong(each.problem)


def _streams(observed: Observations) -> Iterator[Finding]:
    """Streams without messages, with old messages or with messages that cannot be decoded."""
    for stream in observed.streams:
        name, source, counters = stream.name, stream.source, stream.counters
        if counters.received == 0 and counters.refused == 0 and observed.is_well(source):
            yield _error(
                f"Nothing arrives on {name} from the {source}: see whether it runs under the same "
                "bus namespace."
            )
        if counters.refused:
            yield _error(
                f"{counters.refused} messages on {name} could not be read, the last "
                f"because: {counters.last_problem}. Send it as docs/messages.md describes; if the "
                f"{source} is OneMap's own, run the same version there and here."
            )
        # The mapper announces a map again, with the same frame, when a layer is reset.
        if source != "mapper" and counters.disordered >= FEW_DISORDERED:
            yield _error(
                f"{counters.disordered} of {counters.received} messages on {name} have no "
                "higher number than the one before: several processes send them. Run one "
                f"{source} on these keys; its driver must count its messages."
            )
        late_s = (stream.age_s or 0.0) + observed.clocks_s.get(ROBOT, 0.0)
        if stream.age_s is not None and late_s > OLD_S:
            yield _error(
                f"What arrives on {name} is {late_s:.1f} s older than what the robot says now. The "
                f"{source} is too slow: see its metrics with 'onemap status'."
            )


def _clocks(observed: Observations) -> Iterator[Finding]:
    """Clocks that disagree, which nothing but what people compare depends on."""
    other = [
        f"the {whose}'s by {by_s:+.1f} s"
        for whose, by_s in observed.clocks_s.items()
        if abs(by_s) > CLOCK_TOLERANCE_S
    ]
    if other:
        yield Finding(
            Severity.NOTE,
            f"Clocks differ from this machine's: {', '.join(other)}. Nothing stops for it. Times "
            "in logs compare only with one clock (NTP).",
        )


def _map(observed: Observations) -> Iterator[Finding]:
    """A map that stays empty."""
    last = observed.revision
    if last is not None and last.cells_observed == 0 and last.frames_fused >= FEW_FRAMES:
        yield _error(
            f"{last.frames_fused} frames were fused and the map is still empty. All points "
            "are out of the mapper's height or depth range: check extrinsics and depth scale."
        )


def _driving(observed: Observations) -> Iterator[Finding]:
    """A robot that does not follow commands, or that has collided."""
    if observed.commanded > STANDING and observed.driven <= STANDING:
        yield _error(
            "The planner commands motion and the robot stands still. Release the "
            "emergency stop; see that the robot's driver obeys the velocity topic."
        )
    if observed.collided:
        yield _warning(
            "The robot touches an obstacle. Give the planner the robot's true radius; it backs "
            "off by itself."
        )


CHECKS = (_services, _streams, _clocks, _map, _driving)


def diagnose(observed: Observations) -> list[Finding]:
    """All findings: errors, warnings, notes; each sentence once."""
    findings = {f.sentence: f for check in CHECKS for f in check(observed)}
    order = list(Severity)
    return sorted(findings.values(), key=lambda finding: order.index(finding.severity))


COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.NOTE: "dim"}


def examine(config: Path | None, token: str, console: Console) -> list[Finding]:
    """Ask the gateway, observe the bus of this configuration for ``LISTEN_S``, and diagnose."""
    sections = read(config)
    bus_config = section(sections, "bus", BusConfig)
    ending = certificates_that_end(bus_config, datetime.now(timezone.utc))
    if not healthy(ending):  # nothing would answer
        return ending
    port = sections.get("gateway", {}).get("port", DEFAULT_PORT)
    services = services_of(f"http://{LOOPBACK}:{port}", token)
    with temporary_session(bus_config, "doctor", CONNECT_S) as bus:
        listen_s = ALONE_S if services is None else LISTEN_S
        console.print(f"Listening for {listen_s:g} s ...", style="dim")
        return [*ending, *diagnose(observe(bus, listen_s, services))]


def services_of(url: str, token: str) -> tuple[ServiceHealth, ...] | None:
    """What a gateway says of the services; None if it does not answer."""
    try:
        with Client(url, token) as gateway:
            return gateway.status().services
    except OneMapError:
        return None


def certificates_that_end(config: BusConfig, now: datetime) -> list[Finding]:
    """Findings about the certificates of a bus; none where the extra ``certs`` is not there."""
    try:
        from onemap_tools.certificates import ending
    except ImportError:
        return []
    files = [name for endpoint in config.connect for name in IN_ENDPOINT.findall(endpoint)]
    return [
        (_error if ends <= now else _warning)(
            f"The certificate {name} {'ended' if ends <= now else 'ends'} on {ends:%Y-%m-%d}. Make "
            "new ones with 'onemap certs' and give them to the machines."
        )
        for name, ends in ending(files, now).items()
    ]


def describe(findings: list[Finding], console: Console) -> None:
    """Print each finding."""
    for finding in findings:
        severity = Text(finding.severity.value, style=COLOURS[finding.severity])
        console.print(severity, Text(finding.sentence))
    if all(finding.severity is Severity.NOTE for finding in findings):
        console.print("Nothing is wrong that can be seen from here.")


def healthy(findings: list[Finding]) -> bool:
    """Whether there is no error; warnings and notes are allowed."""
    return all(finding.severity is not Severity.ERROR for finding in findings)


def document(findings: list[Finding]) -> dict[str, Any]:
    """The findings as a JSON object."""
    return {"healthy": healthy(findings), "findings": [asdict(each) for each in findings]}
