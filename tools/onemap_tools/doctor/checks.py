"""Pure checks over what was observed of the bus for a few seconds; findings as sentences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum

from onemap_shared.services import doubled_sentence, role_of
from onemap_tools.processes.services import CORE

NEAR_M = 0.1  # below the range of depth cameras: nearer values are a wrong depth scale


@dataclass(frozen=True, slots=True)
class StreamStatus:
    """Counters of one topic. ``age_s``: local clock minus the stamp of the newest message.

    ``disordered``: messages whose number is not higher than that of the one before.
    """

    name: str
    source: str
    count: int = 0
    age_s: float | None = None
    refused: int = 0
    last_problem: str = ""
    disordered: int = 0


@dataclass(frozen=True, slots=True)
class ProcessHealth:
    """Heartbeats of one process.

    ``clock_offset_s``: its clock minus the local clock, less the transport latency.
    ``advanced``: whether its main loop made progress between the heartbeats.
    """

    service: str
    instance: str
    ready: bool
    problem: str
    clock_offset_s: float
    advanced: bool
    metrics: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class DepthStatistics:
    """Statistics of one depth image.

    ``valid``: fraction of pixels with a return; ``median_m`` of those, NaN without any;
    ``near``: fraction of those below ``NEAR_M``.
    """

    valid: float
    median_m: float
    near: float


@dataclass(frozen=True, slots=True)
class MapGrowth:
    """Frame and cell counts at the first and the last revision; encoder of the last."""

    frames: tuple[int, int]
    cells: tuple[int, int]
    encoder_id: str
    text_space: str


@dataclass(frozen=True, slots=True)
class MotionSummary:
    """Largest commanded and measured speed (maximum of m/s and rad/s), and collisions."""

    commanded: float = 0.0
    driven: float = 0.0
    collided: bool = False


@dataclass(frozen=True, slots=True)
class Observations:
    """Everything that was received in ``duration_s`` seconds.

    ``alive``: services with a connected process. ``doubled``: roles that several processes have,
    with their names. ``field_encoder`` and ``text_encoder``:
    (encoder id, text space), None if unknown.
    """

    duration_s: float
    alive: frozenset[str] = frozenset()
    doubled: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    streams: tuple[StreamStatus, ...] = ()
    processes: tuple[ProcessHealth, ...] = ()
    depth: DepthStatistics | None = None
    map: MapGrowth | None = None
    field_encoder: tuple[str, str] | None = None
    text_encoder: tuple[str, str] | None = None
    motion: MotionSummary = MotionSummary()


CLOCK_TOLERANCE_S = 0.3  # above the latency of transport and processing; NTP holds 0.05 s
OLD_S = 2.0  # the robot has driven a metre or more since
FAR_M = 20.0  # larger than any room: a greater median is a wrong depth scale
NO_RETURN_FRACTION = 0.9  # above, too few pixels have depth to map anything
FEW_DISORDERED = 3  # one or two: the publisher was started again
FEW_FRAMES = 5  # fewer fused frames may all show the same view
# Of processes that say what they lack, instead of their log.
REMEDIES = {"ros2": "See what the robot has: onemap ros2 topics, with the same --config."}
COMMAND_EPSILON = 0.02  # m/s or rad/s; below it the robot stands still


class Severity(str, Enum):
    """An error keeps objects from being found, a warning may, a note is a skipped check."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"

    def __str__(self) -> str:
        return self.value


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


def check_services(observed: Observations) -> Iterator[Finding]:
    """Services that do not run, hang, are not ready or run twice."""
    for name in CORE:
        if name not in observed.alive:
            yield _absent(name, observed)
    for role, names in observed.doubled.items():
        yield _error(
            f"{doubled_sentence(role, names)}.",
            "Stop all but one of them, or give each robot a bus.namespace of its own.",
        )
    for name in sorted({process.service for process in observed.processes}):
        processes = [process for process in observed.processes if process.service == name]
        if len(processes) > 1 and role_of(name) not in observed.doubled:
            yield _error(
                f"{len(processes)} processes say that they are the {name}: their messages mix.",
                "Stop all but one of them.",
            )
        for process in processes:
            yield from _unhealthy(process)


def _absent(name: str, observed: Observations) -> Finding:
    """A service that is not connected: it ended, or it hangs by the gateway's metrics."""
    metric = f"hung_{name}_s"
    silent_s = next((p.metrics[metric] for p in observed.processes if metric in p.metrics), None)
    if silent_s is None:
        return _error(f"The {name} is not running.", f"Start it: onemap {name}.")
    return _error(
        f"The {name} has not been heard for {silent_s:.0f} s: its process hangs or its link is "
        "down.",
        "Restart it rather than start a second one; look at its log first.",
    )


def _unhealthy(process: ProcessHealth) -> Iterator[Finding]:
    if not process.advanced:
        yield _error(
            f"The {process.service} runs but its main loop stands still.",
            "Look at its log, then restart it.",
        )
    elif process.problem or not process.ready:
        reason = process.problem or "it does not say why"
        make = _warning if process.ready else _error
        remedy = REMEDIES.get(process.service, "Look at its log.")
        yield make(f"The {process.service} is not well: {reason}.", remedy)


def check_streams(observed: Observations) -> Iterator[Finding]:
    """Streams without messages, with old messages or with messages that cannot be decoded."""
    for stream in observed.streams:
        name, source = stream.name, stream.source
        if stream.count == 0 and stream.refused == 0:
            yield _error(
                f"Nothing arrives on {name} from the {source}.",
                f"See whether the {source} runs, and under the same bus namespace.",
            )
        if stream.refused:
            yield _error(
                f"{stream.refused} messages on {name} could not be read, the last "
                f"because: {stream.last_problem}.",
                f"Send it as docs/messages.md describes; if the {source} is OneMap's "
                "own, run the same version there and here.",
            )
        # The mapper announces a map again, with the same frame, when a layer is reset.
        if source != "mapper" and stream.disordered >= FEW_DISORDERED:
            yield _error(
                f"{stream.disordered} of {stream.count} messages on {name} have no "
                "higher number than the one before: several processes send them.",
                f"Run one {source} on these keys; its driver must count its messages.",
            )
        if stream.age_s is not None and stream.age_s > OLD_S:
            yield _error(
                f"What arrives on {name} is {stream.age_s:.1f} s old.",
                f"The {source} is too slow, or its clock is behind: see its metrics "
                "with 'onemap status'.",
            )


def check_clocks(observed: Observations) -> Iterator[Finding]:
    """Machines whose clocks disagree."""
    for process in observed.processes:
        if abs(process.clock_offset_s) > CLOCK_TOLERANCE_S:
            way = "ahead of" if process.clock_offset_s > 0 else "behind"
            yield _error(
                f"The {process.service}'s clock is {abs(process.clock_offset_s):.1f} s {way} "
                "this machine's.",
                "Synchronise both machines (chrony or NTP): the age of a message is the "
                "difference of their clocks.",
            )
    for stream in observed.streams:
        if stream.age_s is not None and stream.age_s < -CLOCK_TOLERANCE_S:
            yield _error(
                f"Stamps on {stream.name} lie {-stream.age_s:.1f} s in the future.",
                "Synchronise the robot's clock with this machine's (chrony or NTP).",
            )


def check_depth(observed: Observations) -> Iterator[Finding]:
    """Depth images without returns or in another unit than millimetres."""
    depth = observed.depth
    if depth is None:
        return
    if depth.valid < 1 - NO_RETURN_FRACTION:
        yield _error(
            f"Only {depth.valid:.0%} of the depth pixels hold a return.",
            "Check that the depth stream is on, aligned to colour, and not covered.",
        )
    elif depth.near > 0.5:
        yield _error(
            f"Most depth is nearer than {NEAR_M * 100:.0f} cm.",
            "Depth must be in millimetres: metres or raw units were sent, or the lens is covered.",
        )
    elif depth.median_m > FAR_M:
        yield _error(
            f"The median depth is {depth.median_m:.0f} m, more than any room.",
            "Depth must be in millimetres: a finer unit (0.1 mm) was sent.",
        )


def check_floor(observed: Observations) -> Iterator[Finding]:
    """Extrinsics by which the floor is not at z = 0, from the mapper's metrics."""
    mapper = next((p.metrics for p in observed.processes if "floor_viewpoints" in p.metrics), None)
    if mapper is None:
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


def check_encoders(observed: Observations) -> Iterator[Finding]:
    """Features, map and texts of different encoders."""
    encoders = {
        "camera features": observed.field_encoder,
        "the map": (observed.map.encoder_id, observed.map.text_space) if observed.map else None,
        "texts": observed.text_encoder,
    }
    known = {what: encoder for what, encoder in encoders.items() if encoder and any(encoder)}
    if len(set(known.values())) > 1:
        parts = ", ".join(f"{what} from {encoder[0]!r}" for what, encoder in known.items())
        yield _error(
            f"Encoders differ: {parts}.",
            "Clear the map ('onemap map clear') or load one that was made with this encoder.",
        )


def check_map(observed: Observations) -> Iterator[Finding]:
    """A map that receives no frames, stays empty or does not grow."""
    growth = observed.map
    if growth is None:
        return
    if growth.frames[1] == growth.frames[0]:
        yield _error(
            f"No frame reached the map in {observed.duration_s:.0f} s.",
            "Follow the frames: robot, perception, mapper; the first silent one is it.",
        )
    elif growth.cells[1] == 0 and growth.frames[1] >= FEW_FRAMES:
        yield _error(
            f"{growth.frames[1]} frames were fused and the map is still empty.",
            "All points are out of the mapper's height or depth range: check extrinsics and depth "
            "scale.",
        )
    elif growth.cells[1] == growth.cells[0] and observed.motion.driven > COMMAND_EPSILON:
        yield _warning(
            "The robot drives and the map does not grow.",
            "Fine where all is mapped already; otherwise check that the pose changes too.",
        )


def check_driving(observed: Observations) -> Iterator[Finding]:
    """A robot that does not follow commands, or that has collided."""
    if observed.motion.commanded > COMMAND_EPSILON and observed.motion.driven <= COMMAND_EPSILON:
        yield _error(
            "The planner commands motion and the robot stands still.",
            "Release the emergency stop; see that the robot's driver obeys the velocity topic.",
        )
    if observed.motion.collided:
        yield _warning(
            "The robot touches an obstacle.",
            "Give the planner the robot's true radius; it backs off by itself.",
        )


CHECKS = (
    check_services,
    check_streams,
    check_clocks,
    check_depth,
    check_floor,
    check_encoders,
    check_map,
    check_driving,
)


def diagnose(observed: Observations) -> list[Finding]:
    """All findings: errors, warnings, notes; each sentence once."""
    findings = {f.sentence: f for check in CHECKS for f in check(observed)}
    order = list(Severity)
    return sorted(findings.values(), key=lambda finding: order.index(finding.severity))
