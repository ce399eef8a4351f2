"""Runs the detector on frames, in a thread of its own where it needs no features."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

from onemap_perception.detectors.protocol import Detector
from onemap_perception.target_detection import Target, detect_in_frame
from onemap_shared.geometry import F16
from onemap_shared.messages import Detections, RgbdFrame


@dataclass(frozen=True, slots=True)
class DetectionResult:
    """Detections of ``target`` in one frame, and how long they took."""

    target: Target
    detections: Detections
    detect_ms: float


class DetectorRunner:
    """Runs the detector on one frame at a time. Used from one thread.

    A detector that reads the encoder's features runs after it, in the caller's thread. Any
    other has a thread of its own and sees a frame while the encoder does; frames that come
    before it is done are passed over and counted, so that a slow detector never holds up the map.
    """

    def __init__(self, detector: Detector, clock_s: Callable[[], float]) -> None:
        self.skipped = 0
        self._detector = detector
        self._clock_s = clock_s
        self._executor = None if detector.reads_features else ThreadPoolExecutor(1, "detector")
        self._pending: Future[DetectionResult] | None = None

    def before_encoding(self, frame: RgbdFrame, target: Target) -> None:
        """Begin with a frame, if the detector needs no features and is free."""
        if self._executor is None:
            return
        if self._pending is not None:
            self.skipped += 1
            return
        self._pending = self._executor.submit(self._detect, target, frame)

    def after_encoding(
        self, frame: RgbdFrame, features: F16, target: Target
    ) -> DetectionResult | None:
        """What was found: in this frame, or in an earlier one that is done by now."""
        if self._executor is None:
            return self._detect(target, frame, features)
        return self.collect()

    def collect(self) -> DetectionResult | None:
        """What the detector's own thread has found since, if it is done; raises what it raised."""
        if self._pending is None or not self._pending.done():
            return None
        done, self._pending = self._pending, None
        return done.result()

    def close(self) -> None:
        """Wait for the frame that is being looked at."""
        if self._executor is not None:
            self._executor.shutdown(cancel_futures=True)

    def _detect(
        self, target: Target, frame: RgbdFrame, features: F16 | None = None
    ) -> DetectionResult:
        begun_s = self._clock_s()
        detections = detect_in_frame(self._detector, target, frame, features)
        return DetectionResult(target, detections, (self._clock_s() - begun_s) * 1e3)
