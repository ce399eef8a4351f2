"""What perception counts and times, and what it says of itself."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

WINDOW_S = 5.0  # over which the frame rate is taken
PATIENCE_S = 2.0  # silence shorter than this is a hiccup, not a problem


@dataclass(slots=True)
class PerceptionTelemetry:
    """Counters of one worker. Written by its loop, read by the heartbeat: each field is
    replaced whole, so a reader sees old or new, never half."""

    started_s: float
    encode_ms: float = 0.0
    detect_ms: float = 0.0
    frame_age_ms: float = 0.0
    encoded_at_s: tuple[float, ...] = ()
    frames_failed: int = 0
    detections_failed: int = 0
    out_of_memory: int = 0
    failure: str = ""
    detector_failure: str = ""
    text_problem: str = ""

    def frame_done(self, now_s: float, *, encode_ms: float, frame_age_ms: float) -> None:
        """A frame was encoded and published at ``now_s`` (monotonic)."""
        recent = deque(self.encoded_at_s)
        recent.append(now_s)
        while recent[0] < now_s - WINDOW_S:
            recent.popleft()
        self.encoded_at_s = tuple(recent)
        self.encode_ms, self.frame_age_ms = encode_ms, frame_age_ms
        self.failure = ""

    def frame_failed(self, reason: str, out_of_memory: bool) -> None:
        """A frame was dropped because of this."""
        self.frames_failed += 1
        self.out_of_memory += out_of_memory
        self.failure = reason

    def detection_done(self, detect_ms: float) -> None:
        """The detector ended with a frame."""
        self.detect_ms = detect_ms
        self.detector_failure = ""

    def detection_failed(self, reason: str, out_of_memory: bool) -> None:
        """A frame was encoded, but could not be looked at because of this."""
        self.detections_failed += 1
        self.out_of_memory += out_of_memory
        self.detector_failure = reason

    @property
    def timings(self) -> dict[str, float]:
        """Of the newest frame, in milliseconds; empty before the first."""
        if not self.encoded_at_s:
            return {}
        return {
            "encode_ms": self.encode_ms,
            "detect_ms": self.detect_ms,
            "frame_age_ms": self.frame_age_ms,
        }

    def is_ready(self, now_s: float, silent_after_s: float) -> bool:
        """Whether a frame was encoded lately."""
        return self._silence_s(now_s) < silent_after_s and bool(self.encoded_at_s)

    def problem(self, now_s: float, *, silent_after_s: float, camera_key: str) -> str:
        """One sentence about the worst that is wrong, empty if all is well."""
        silence_s = self._silence_s(now_s)
        if self.failure:
            return f"frames cannot be encoded: {self.failure}"
        if silence_s >= min(silent_after_s, PATIENCE_S):
            return f"no camera frames on {camera_key} for {silence_s:.1f} s"
        if not self.encoded_at_s:
            return f"waiting for the first camera frame on {camera_key}"
        if self.detector_failure:
            return f"nothing can be detected: {self.detector_failure}"
        return self.text_problem

    def rate_hz(self, now_s: float) -> float:
        """Frames per second over the last seconds."""
        return sum(at > now_s - WINDOW_S for at in self.encoded_at_s) / WINDOW_S

    def _silence_s(self, now_s: float) -> float:
        return now_s - (self.encoded_at_s[-1] if self.encoded_at_s else self.started_s)
