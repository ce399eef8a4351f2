"""How long a camera frame takes to the map, the detections and the command, as histograms.

A frame is timed from its arrival at the gateway to that of the result with its capture stamp, so
that the clocks of two machines need not agree.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import ceil

BOUNDS_S = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 5.0)
KEPT_FRAMES = 64  # 4 s at 15 Hz: a later result is not timed
RECENT = 200  # latencies of which the quantiles are: 25 s at 8 Hz


@dataclass(frozen=True, slots=True)
class LatencyHistogram:
    """Counts per interval of ``BOUNDS_S``, the last one without an upper bound, and their sum.

    recent_s: the newest ``RECENT`` latencies, oldest first.
    """

    counts: tuple[int, ...] = (0,) * (len(BOUNDS_S) + 1)
    total_s: float = 0.0
    recent_s: tuple[float, ...] = ()

    def with_value(self, latency_s: float) -> LatencyHistogram:
        """The histogram with one more latency, seconds; a bound belongs to its own interval."""
        index = bisect_left(BOUNDS_S, latency_s)
        counts = (*self.counts[:index], self.counts[index] + 1, *self.counts[index + 1 :])
        recent_s = (*self.recent_s, latency_s)[-RECENT:]
        return LatencyHistogram(counts, self.total_s + latency_s, recent_s)

    def quantile_s(self, share: float) -> float:
        """The latency that this share of the recent ones does not exceed; 0 without any.

        The smallest such value that was measured (nearest rank), not interpolated.
        """
        ordered = sorted(self.recent_s)
        return ordered[max(ceil(share * len(ordered)), 1) - 1] if ordered else 0.0


@dataclass(frozen=True, slots=True)
class FrameLatencies:
    """Latencies per stage, and what it takes to time the next.

    arrivals: capture stamp and arrival time of the newest frames; timed_ns: the newest stamp that
    was timed of each stage, because a stage may send several messages of one frame.
    """

    arrivals: tuple[tuple[int, float], ...] = ()
    stages: Mapping[str, LatencyHistogram] = field(default_factory=dict)
    timed_ns: Mapping[str, int] = field(default_factory=dict)

    def with_frame(self, stamp_ns: int, now_s: float) -> FrameLatencies:
        """After a frame of this stamp arrived."""
        return replace(self, arrivals=(*self.arrivals, (stamp_ns, now_s))[-KEPT_FRAMES:])

    def with_result(self, stage: str, stamp_ns: int, now_s: float) -> FrameLatencies:
        """After the result of a stage arrived; unchanged if its frame is not known."""
        arrived_s = dict(self.arrivals).get(stamp_ns)
        if arrived_s is None or self.timed_ns.get(stage) == stamp_ns:
            return self
        histogram = self.stages.get(stage, LatencyHistogram())
        timed = histogram.with_value(max(now_s - arrived_s, 0.0))
        return replace(
            self,
            stages={**self.stages, stage: timed},
            timed_ns={**self.timed_ns, stage: stamp_ns},
        )
