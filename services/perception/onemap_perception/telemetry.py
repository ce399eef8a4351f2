"""Counters, timings and health of perception."""

from __future__ import annotations

from dataclasses import dataclass, field

from onemap_shared.rates import RateMeter

FRAME_TIMEOUT_S = 5.0  # without a camera frame, after which perception is not ready
SHORT_SILENCE_S = 2.0  # a shorter pause between frames is no problem


@dataclass(slots=True)
class PerceptionTelemetry:
    """Counters of one worker. Written by its loop, read by the heartbeat's thread: each field is
    replaced whole, so a reader sees the old or the new value."""

    started_s: float
    encode_ms: float = 0.0
    detect_ms: float = 0.0
    frame_age_ms: float = 0.0
    encoded: RateMeter = field(default_factory=RateMeter)
    frames_failed: int = 0
    detections_failed: int = 0
    out_of_memory: int = 0
    failure: str = ""
    detector_failure: str = ""
    text_problem: str = ""

    def frame_done(self, now_s: float, *, encode_ms: float, frame_age_ms: float) -> None:
        """A frame was encoded and published at ``now_s`` (monotonic)."""
        self.encoded = self.encoded.with_event(now_s)
        self.encode_ms, self.frame_age_ms = encode_ms, frame_age_ms
        self.failure = ""

    def frame_failed(self, reason: str, out_of_memory: bool) -> None:
        """A frame was dropped for this reason."""
        self.frames_failed += 1
        self.out_of_memory += out_of_memory
        self.failure = reason

    def detection_done(self, detect_ms: float) -> None:
        """The detector finished a frame."""
        self.detect_ms = detect_ms
        self.detector_failure = ""

    def detection_failed(self, reason: str, out_of_memory: bool) -> None:
        """The detector failed on a frame for this reason."""
        self.detections_failed += 1
        self.out_of_memory += out_of_memory
        self.detector_failure = reason

    @property
    def timings(self) -> dict[str, float]:
        """Of the newest frame, in milliseconds; empty before the first."""
        if not self.encoded.times_s:
            return {}
        return {
            "encode_ms": self.encode_ms,
            "detect_ms": self.detect_ms,
            "frame_age_ms": self.frame_age_ms,
        }

    def is_ready(self, now_s: float) -> bool:
        """Whether a frame was encoded in the last ``FRAME_TIMEOUT_S``."""
        return bool(self.encoded.times_s) and self._silent_s(now_s) < FRAME_TIMEOUT_S

    def problem(self, now_s: float, camera_key: str) -> str:
        """One sentence about the most serious problem; empty if there is none."""
        silent_s = self._silent_s(now_s)
        if self.failure:
            return f"frames cannot be encoded: {self.failure}"
        if silent_s >= SHORT_SILENCE_S:
            return f"no camera frames on {camera_key} for {silent_s:.1f} s"
        if not self.encoded.times_s:
            return f"waiting for the first camera frame on {camera_key}"
        if self.detector_failure:
            return f"nothing can be detected: {self.detector_failure}"
        return self.text_problem

    def _silent_s(self, now_s: float) -> float:
        return self.encoded.silent_s(now_s, since_s=self.started_s)
