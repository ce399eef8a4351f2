"""A link as packets see it: rate, delay, loss and a buffer that overflows."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

BUFFER_S = 0.1  # of a full queue, as access points keep it; what comes then is dropped
MIN_BUFFER_BYTES = 64 * 1024  # of slow links: a few packets of every connection


@dataclass(frozen=True, slots=True)
class LinkShape:
    """One direction of a link. rate_bps: bits per second; delay_s: added to every packet; loss:
    share of packets in [0, 1) that never arrive, drawn one by one."""

    rate_bps: float
    delay_s: float = 0.0
    loss: float = 0.0

    def __post_init__(self) -> None:
        if not self.rate_bps > 0:
            raise ValueError(f"the link's rate is {self.rate_bps} bit/s; it must be above 0")
        if not self.delay_s >= 0:
            raise ValueError(f"the link's delay is {self.delay_s} s; it must not be negative")
        if not 0 <= self.loss < 1:
            raise ValueError(f"the link's loss is {self.loss}; it must lie in [0, 1)")


@dataclass(slots=True)
class PacketQueue:
    """The packets on one direction of a link. Times are seconds of one monotonic clock."""

    shape: LinkShape
    rng: np.random.Generator
    carried_bytes: int = 0
    dropped: int = 0
    _free_s: float = 0.0  # when the last packet has left
    _under_way: deque[tuple[float, bytes]] = field(default_factory=deque)

    def offer(self, packet: bytes, now_s: float) -> None:
        """A packet begins its way, or is dropped."""
        waiting_s = max(self._free_s - now_s, 0.0)
        limit_s = max(BUFFER_S, 8 * MIN_BUFFER_BYTES / self.shape.rate_bps)
        lost = self.shape.loss > 0 and self.rng.random() < self.shape.loss
        if waiting_s > limit_s or lost:
            self.dropped += 1
            return
        self._free_s = now_s + waiting_s + 8 * len(packet) / self.shape.rate_bps
        self._under_way.append((self._free_s + self.shape.delay_s, packet))

    def arrived(self, now_s: float) -> list[bytes]:
        """The packets that arrived since the last call, in their order."""
        packets = []
        while self._under_way and self._under_way[0][0] <= now_s:
            packets.append(self._under_way.popleft()[1])
            self.carried_bytes += len(packets[-1])
        return packets

    def next_s(self) -> float | None:
        """When the next packet arrives; None if none is under way."""
        return self._under_way[0][0] if self._under_way else None
