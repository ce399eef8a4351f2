"""Runs the detector on frames, in a thread of its own where it needs no features."""
# Talks: runs the detector beside the encoder.

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

from onemap_perception.detectors.protocol import Detector
from onemap_perception.target_detection import Target, detect_in_frame
from onemap_shared.geometry import F16, U8
from onemap_shared.messages import Detections, RgbdFrame


@dataclass(frozen=True, slots=True)
class DetectionResult:
    """Detections of ``target`` in one frame with image ``rgb``, and how long they took."""

    target: Target
    rgb: U8
    detections: Detections
    detect_ms: float


class DetectorRunner:
    """Runs the detector on one frame at a time. Used from one thread.

    A detector that reads the encoder's features runs after it, in the caller's thread. Any
    other runs in a thread of its own, at the same time as the encoder; frames that arrive while
    it is busy are skipped and counted, so that a slow detector does not delay the map.
    """

    def __init__(self, detector: Detector, clock_s: Callable[[], float]) -> None:
        self.skipped = 0
        self._detector = detector
        self._clock_s = clock_s
        self._executor = None if detector.reads_features else ThreadPoolExecutor(1, "detector")
        self._pending: Future[DetectionResult] | None = None

    def before_encoding(self, frame: RgbdFrame, target: Target) -> None:
        """Start on a frame, if the detector needs no features and is free."""
        if self._executor is None:
            return
        if self._pending is not None:
            self.skipped += 1
            return
        self._pending = self._executor.submit(self._detect, target, frame)

    def after_encoding(
        self, frame: RgbdFrame, features: F16, target: Target
    ) -> DetectionResult | None:
        """The result for this frame, or for an earlier one that is finished by now.

        features (h, w, D) float16: those of the frame.
        """
        if self._executor is None:
            return self._detect(target, frame, features)
        return self.collect()

    def collect(self) -> DetectionResult | None:
        """The result of the detector's own thread, if it is finished; raises what it raised."""
        if self._pending is None or not self._pending.done():
            return None
        done, self._pending = self._pending, None
        return done.result()

    def close(self) -> None:
        """Wait for the current frame."""
        if self._executor is not None:
            self._executor.shutdown(cancel_futures=True)

    def _detect(
        self, target: Target, frame: RgbdFrame, features: F16 | None = None
    ) -> DetectionResult:
        begun_s = self._clock_s()
        detections = detect_in_frame(self._detector, target, frame, features)
        return DetectionResult(target, frame.rgb, detections, (self._clock_s() - begun_s) * 1e3)
