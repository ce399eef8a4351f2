"""Which frames come late: told by their sequence, because a robot's clock may be set back."""

from __future__ import annotations

from dataclasses import dataclass

# A frame that is older than the map by this and more is no late one: the clock was set back or
# another recording began.
CLOCK_JUMP_NS = 10 * 10**9
# Frames that seem late, each with a higher sequence than the one before, after which they are the
# stream of a robot that began to count anew.
NEW_STREAM_FRAMES = 3


@dataclass(frozen=True, slots=True)
class FrameStamp:
    """The sequence of a frame and its time of capture."""

    sequence: int
    stamp_ns: int


@dataclass(slots=True)
class FrameOrder:
    """Tells late frames. Holds the last one, and how many came in a row."""

    _last: int = -1
    _run: int = 0

    def is_late(self, frame: FrameStamp, newest: FrameStamp) -> bool:
        """Whether a frame was captured before the newest one of the map, stamp 0 for no frame."""
        back_ns = newest.stamp_ns - frame.stamp_ns
        late = frame.sequence <= newest.sequence and 0 < back_ns < CLOCK_JUMP_NS
        self._run = (self._run if frame.sequence > self._last else 0) + 1 if late else 0
        self._last = frame.sequence if late else -1
        return late and self._run < NEW_STREAM_FRAMES
