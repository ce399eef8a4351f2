"""The heartbeat that every service publishes."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """One a second from every service.

    Attributes:
        service: its name, as in the key.
        instance: which process of that service.
        stamp_ns: when it was sent, in nanoseconds of that machine's wall clock.
        progress: a count that stops when the service's loop hangs.
        ready: whether the service does its work.
        problem: one sentence if something is wrong, else empty.
        metrics: name to number, shown at /metrics as onemap_<service>_<name>.
    """

    service: str
    instance: str
    stamp_ns: int
    progress: int
    ready: bool
    problem: str = ""
    metrics: dict[str, float] = field(default_factory=dict)
