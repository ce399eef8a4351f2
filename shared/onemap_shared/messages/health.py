"""The heartbeat that every service publishes."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """One a second from every service. ``progress`` stops when the service's loop hangs.

    ready: the service does its work; problem: one sentence if something is wrong.
    metrics: name -> number, shown at /metrics as onemap_<service>_<name>.
    """

    service: str
    instance: str
    stamp_ns: int
    progress: int
    ready: bool
    problem: str = ""
    metrics: dict[str, float] = field(default_factory=dict)
