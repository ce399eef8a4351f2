"""``onemap doctor``: what ``/v1/status`` says is wrong, and what a listener on the bus can tell."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from datetime import datetime, timezone
from enum import Enum
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from onemap import Client, OneMapError
from onemap.replies import ServiceHealth
from onemap_shared import keys
from onemap_shared.config import BusConfig, read, section
from onemap_shared.messages import MapRevision
from onemap_shared.services import DRIVER
from onemap_shared.tls_files import IN_ENDPOINT
from onemap_shared.transport import Bus, Counters
from onemap_tools.gateway import cli_error
from onemap_tools.processes.network import DEFAULT_PORT, LOOPBACK
from onemap_tools.processes.session import temporary_session

CONNECT_S = 3.0
LISTEN_S = 3.5  # three heartbeats of every service
POLL_S = 0.02
QUEUE = 64  # messages held between two polls
CLOCK_TOLERANCE_S = 0.3  # above the latency of transport and processing; NTP holds 0.05 s
FEW_FRAMES = 5  # fewer fused frames may all show the same view
OK, DOWN = "ok", "down"  # conditions of a service
# A frame's way, and who publishes it; of the large ones only the newest is held.
STREAMS: tuple[tuple[keys.Topic[Any], str, int], ...] = (
    (keys.ROBOT_RGBD, DRIVER, 1),
    (keys.ROBOT_ODOMETRY, DRIVER, QUEUE),
    (keys.FIELD, "perception", 1),
    (keys.MAP_REVISION, "mapper", QUEUE),
)


@dataclass(frozen=True, slots=True)
class ObservedStream:
    """A topic, who publishes it, and what came on it."""

    name: str
    source: str
    counters: Counters


@dataclass(frozen=True, slots=True)
class Observations:
    """What was seen. clocks_s: of services and robot, minus the local one, less the latency;
    revision: of the map, the newest."""

    services: tuple[ServiceHealth, ...] = ()
    streams: tuple[ObservedStream, ...] = ()
    clocks_s: Mapping[str, float] = field(default_factory=dict)
    revision: MapRevision | None = None

    def is_well(self, service: str) -> bool:
        """Whether nothing is wrong with a service as far as it is known."""
        return all(each.condition == OK for each in self.services if each.name == service)


def observe(bus: Bus, duration_s: float, services: tuple[ServiceHealth, ...] = ()) -> Observations:
    """Listen on the bus for so long."""
    streams = [(bus.subscribe(topic, held), topic, source) for topic, source, held in STREAMS]
    beats, clocks_s = bus.subscribe(keys.ALL_HEARTBEATS, QUEUE), dict[str, float]()
    revision: MapRevision | None = None
    end_s = time.monotonic() + duration_s
    while time.monotonic() < end_s:
        for subscription, topic, source in streams:
            while (message := subscription.take(0.0)) is not None:
                if topic == keys.ROBOT_ODOMETRY:
                    _compare(clocks_s, source, message.stamp_ns)
                revision = message if topic == keys.MAP_REVISION else revision
        while (beat := beats.take(0.0)) is not None:
            _compare(clocks_s, beat.service, beat.stamp_ns)
        time.sleep(POLL_S)
    observed = (ObservedStream(topic.key, source, s.counters) for s, topic, source in streams)
    return Observations(services, tuple(observed), clocks_s, revision)


def _compare(clocks_s: dict[str, float], whose: str, stamp_ns: int) -> None:
    """Add how far a clock is ahead; the youngest message counts: latency only makes them older."""
    ahead_s = (stamp_ns - time.time_ns()) / 1e9
    clocks_s[whose] = max(clocks_s.get(whose, ahead_s), ahead_s)


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


def _services(observed: Observations) -> Iterator[Finding]:
    """What ``/v1/status`` says."""
    for each in observed.services:
        if each.condition != OK:
            runs = each.ready and each.condition != DOWN
            yield Finding(Severity.WARNING if runs else Severity.ERROR, each.problem)


def _streams(observed: Observations) -> Iterator[Finding]:
    """Streams without messages, or with messages that cannot be decoded."""
    for stream in observed.streams:
        name, source, counters = stream.name, stream.source, stream.counters
        if counters.received == 0 and counters.refused == 0 and observed.is_well(source):
            yield Finding(
                Severity.ERROR,
                f"Nothing arrives on {name} from the {source}: see whether it runs under the same "
                "bus namespace.",
            )
        if counters.refused:
            yield Finding(
                Severity.ERROR,
                f"{counters.refused} messages on {name} could not be read, the last "
                f"because: {counters.last_problem}. Send it as docs/messages.md describes; if the "
                f"{source} is OneMap's own, run the same version there and here.",
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
        yield Finding(
            Severity.ERROR,
            f"{last.frames_fused} frames were fused and the map is still empty. All points "
            "are out of the mapper's height or depth range: check extrinsics and depth scale.",
        )


def diagnose(observed: Observations) -> list[Finding]:
    """All findings: errors, warnings, notes; each sentence once."""
    checks = (_services, _streams, _clocks, _map)
    findings = {f.sentence: f for check in checks for f in check(observed)}
    order = list(Severity)
    return sorted(findings.values(), key=lambda finding: order.index(finding.severity))


COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.NOTE: "dim"}


def examine(config: Path | None, token: str, console: Console) -> list[Finding]:
    """Ask the gateway, listen on the bus of this configuration, and diagnose."""
    sections = read(config)
    bus_config = section(sections, "bus", BusConfig)
    ending = certificates_that_end(bus_config, datetime.now(timezone.utc))
    if not healthy(ending):  # nothing would answer
        return ending
    port = sections.get("gateway", {}).get("port", DEFAULT_PORT)
    services, absent = services_of(f"http://{LOOPBACK}:{port}", token)
    with temporary_session(bus_config, "doctor", CONNECT_S) as bus:
        console.print(f"Listening for {LISTEN_S:g} s ...", style="dim")
        return [*ending, *absent, *diagnose(observe(bus, LISTEN_S, services))]


def services_of(url: str, token: str) -> tuple[tuple[ServiceHealth, ...], list[Finding]]:
    """What a gateway says of the services, and what is wrong if it does not answer."""
    try:
        with Client(url, token) as gateway:
            return gateway.status().services, []
    except OneMapError as error:
        return (), [Finding(Severity.ERROR, str(cli_error(error)))]


def certificates_that_end(config: BusConfig, now: datetime) -> list[Finding]:
    """Findings about the certificates of a bus; none where the extra ``certs`` is not there."""
    try:
        from onemap_tools.certificates import ending
    except ImportError:
        return []
    files = [name for endpoint in config.connect for name in IN_ENDPOINT.findall(endpoint)]
    return [
        Finding(
            Severity.ERROR if ends <= now else Severity.WARNING,
            f"The certificate {name} {'ended' if ends <= now else 'ends'} on {ends:%Y-%m-%d}. Make "
            "new ones with 'onemap certs' and give them to the machines.",
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
