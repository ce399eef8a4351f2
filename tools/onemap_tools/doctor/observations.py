"""What a doctor observes on the bus: the input of its checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

NEAR_M = 0.1  # no depth camera measures nearer: everything below is a scale error


@dataclass(frozen=True, slots=True)
class StreamStatus:
    """A topic as it was heard. ``age_s``: receiver's clock less the newest stamp."""

    name: str
    source: str
    count: int = 0
    age_s: float | None = None
    refused: int = 0
    last_problem: str = ""


@dataclass(frozen=True, slots=True)
class ProcessHealth:
    """Heartbeats of one process. ``clock_offset_s``: its clock less ours, transport included."""

    service: str
    instance: str
    ready: bool
    problem: str
    clock_offset_s: float
    advanced: bool
    metrics: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class DepthStatistics:
    """The newest depth image in numbers.

    valid: fraction of pixels with a return; median_m of those, NaN if none; near: fraction
    of those below ``NEAR_M``.
    """

    valid: float
    median_m: float
    near: float


@dataclass(frozen=True, slots=True)
class MapGrowth:
    """The map's state when the doctor came and when it left."""

    frames: tuple[int, int]
    cells: tuple[int, int]
    encoder_id: str
    text_space: str


@dataclass(frozen=True, slots=True)
class MotionSummary:
    """Largest speeds commanded and driven (m/s or rad/s, whichever is larger), and collisions."""

    commanded: float = 0.0
    driven: float = 0.0
    collided: bool = False


@dataclass(frozen=True, slots=True)
class Observations:
    """What was heard on the bus in ``duration_s`` seconds.

    alive: services with a connected process; field_encoder and text_encoder are
    (encoder id, text space), None if nobody said.
    """

    duration_s: float
    alive: frozenset[str] = frozenset()
    streams: tuple[StreamStatus, ...] = ()
    processes: tuple[ProcessHealth, ...] = ()
    depth: DepthStatistics | None = None
    map: MapGrowth | None = None
    field_encoder: tuple[str, str] | None = None
    text_encoder: tuple[str, str] | None = None
    motion: MotionSummary = MotionSummary()

    def stream(self, name: str) -> StreamStatus | None:
        """The stream of this name."""
        return next((stream for stream in self.streams if stream.name == name), None)
