"""Observations of the bus over a few seconds: the input of the checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

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
