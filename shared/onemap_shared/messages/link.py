"""The receipt of a frame or a field."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FrameReceipt:
    """A stage took this frame and begins to work on it: its sender may send another.

    Attributes:
        sequence: of the frame.
        stamp_ns: of the frame.
    """

    sequence: int
    stamp_ns: int
