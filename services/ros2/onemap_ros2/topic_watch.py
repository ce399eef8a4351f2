"""How often the robot's topics speak, and which of them fell silent."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from onemap_ros2.cdr import NS, FormatError, peek_stamp_ns

SILENT_S = 3.0  # three times what a camera at 1 Hz needs; a lost link recovers in less
COUNTED = 31  # arrivals that a rate is taken from: a second of a camera
TF_STAMP = 8  # where the stamp of the first transform stands: after the length of the list


@dataclass(slots=True)
class TopicWatch:
    """The arrivals of one topic. Times are monotonic seconds.

    since_s: since when it is listened to. kind: its setting. stamp_ns: of the newest message, on
    the robot's clock; None before the first, or if it has none.
    """

    kind: str
    topic: str
    since_s: float
    messages: int = 0
    stamp_ns: int | None = None
    _arrived_s: deque[float] = field(default_factory=lambda: deque(maxlen=COUNTED))

    def add(self, data: bytes, now_s: float) -> None:
        """Count a message."""
        self.messages += 1
        self._arrived_s.append(now_s)
        try:
            self.stamp_ns = peek_stamp_ns(data, TF_STAMP if self.kind == "tf" else 4)
        except FormatError:
            self.stamp_ns = None  # what reads it says why it is unusable

    def silent_s(self, now_s: float) -> float:
        """Seconds without a message."""
        return now_s - (self._arrived_s[-1] if self._arrived_s else self.since_s)

    @property
    def rate_hz(self) -> float:
        """Messages per second until the newest one; 0 before the second."""
        times = self._arrived_s.copy()
        lasted_s = times[-1] - times[0] if times else 0.0
        return (len(times) - 1) / lasted_s if lasted_s > 0 else 0.0

    def silence(self, now_s: float) -> str:
        """One clause that names a topic silent for ``SILENT_S``; empty for one that speaks."""
        silent_s = self.silent_s(now_s)
        if silent_s < SILENT_S:
            return ""
        if self.messages == 0:
            return f"{self.topic} has sent nothing in {silent_s:.0f} s"
        before = f"{self.rate_hz:.1f} Hz before"
        stamp = f", last stamp {self.stamp_ns / NS:.3f} s" if self.stamp_ns is not None else ""
        return f"{self.topic} is silent for {silent_s:.0f} s ({before}{stamp})"
