"""Perception on the bus: subscribes to frames, publishes feature fields and detections."""
# Talks: the bus; runs the detector beside the encoder.

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field

from onemap_perception.config import PerceptionConfig
from onemap_perception.detectors.protocol import Detector
from onemap_perception.encoders.images import decoded
from onemap_perception.encoders.protocol import ImageEncoder
from onemap_perception.errors import (
    BackendError,
    ImageError,
    OutOfDeviceMemoryError,
    UnknownWordError,
)
from onemap_perception.factory import make_detector, make_encoder
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_perception.target_detection import Target, detect_in_frame, make_target, with_picture
from onemap_shared import keys
from onemap_shared.clock import Clock, Future
from onemap_shared.geometry import F16, U8
from onemap_shared.messages import (
    Detections,
    FrameReceipt,
    ImageRequest,
    RgbdFrame,
    SearchStatus,
    TextEmbeddings,
    TextRequest,
)
from onemap_shared.rates import RateMeter
from onemap_shared.runner import StartError, WorkerFailed
from onemap_shared.transport import Bus, Health, RequestRejected, Worker

LOG = logging.getLogger("onemap.perception")
FRAME_TIMEOUT_S = 5.0  # without a camera frame, after which perception is not ready
SHORT_SILENCE_S = 2.0  # a shorter pause between frames is no problem
# Frames in a row that fail for another reason than a full memory, after which only a new process
# helps: after an error of CUDA every later call fails. A strange image is one, not so many.
MAX_FAILED_IN_ROW = 50


@dataclass(slots=True)
class PerceptionTelemetry:
    """Counters of one worker. Written by its loop, read by the heartbeat's thread: each field is
    replaced whole, so a reader sees the old or the new value."""

    started_s: float
    encode_ms: float = 0.0
    detect_ms: float = 0.0
    encoded: RateMeter = field(default_factory=RateMeter)
    frames_failed: int = 0
    detections_failed: int = 0
    out_of_memory: int = 0
    encoder_failed_in_row: int = 0
    detector_failed_in_row: int = 0
    failure: str = ""
    detector_failure: str = ""
    text_problem: str = ""

    def frame_done(self, now_s: float, *, encode_ms: float) -> None:
        """A frame was encoded and published at ``now_s`` (monotonic)."""
        self.encoded = self.encoded.with_event(now_s)
        self.encode_ms = encode_ms
        self.failure, self.encoder_failed_in_row = "", 0

    def frame_failed(self, problem: BackendError) -> None:
        """A frame was dropped because of this."""
        full = isinstance(problem, OutOfDeviceMemoryError)
        self.frames_failed += 1
        self.out_of_memory += full
        self.encoder_failed_in_row += not full
        self.failure = str(problem)

    def detection_done(self, detect_ms: float) -> None:
        """The detector finished a frame."""
        self.detect_ms = detect_ms
        self.detector_failure, self.detector_failed_in_row = "", 0

    def detection_failed(self, problem: BackendError) -> None:
        """The detector failed on a frame because of this."""
        full = isinstance(problem, OutOfDeviceMemoryError)
        self.detections_failed += 1
        self.out_of_memory += full
        self.detector_failed_in_row += not full
        self.detector_failure = str(problem)

    @property
    def hopeless(self) -> str:
        """Why no later frame can be expected to succeed, in one sentence; empty if it can."""
        if self.encoder_failed_in_row >= MAX_FAILED_IN_ROW:
            return f"{MAX_FAILED_IN_ROW} frames in a row could not be encoded: {self.failure}"
        if self.detector_failed_in_row >= MAX_FAILED_IN_ROW:
            why = self.detector_failure
            return f"the detector failed on {MAX_FAILED_IN_ROW} frames in a row: {why}"
        return ""

    @property
    def timings(self) -> dict[str, float]:
        """Of the newest frame, in milliseconds; empty before the first."""
        if not self.encoded.times_s:
            return {}
        return {
            "encode_ms": self.encode_ms,
            "detect_ms": self.detect_ms,
        }

    def is_ready(self, now_s: float) -> bool:
        """Whether a frame was encoded in the last ``FRAME_TIMEOUT_S``."""
        return bool(self.encoded.times_s) and self._silent_s(now_s) < FRAME_TIMEOUT_S

    def problem(self, now_s: float, camera_key: str) -> str:
        """One sentence about the most serious problem; empty if there is none."""
        silent_s = self._silent_s(now_s)
        if self.failure:
            return f"frames cannot be encoded: {self.failure}"
        if not self.encoded.times_s:
            return f"waiting for the first camera frame on {camera_key}"
        if silent_s >= SHORT_SILENCE_S:
            return f"no camera frames on {camera_key} for {silent_s:.1f} s"
        if self.detector_failure:
            return f"nothing can be detected: {self.detector_failure}"
        return self.text_problem

    def _silent_s(self, now_s: float) -> float:
        return self.encoded.silent_s(now_s, since_s=self.started_s)


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
    it is busy are skipped and counted, so that a slow detector does not delay the map. done: called
    when that thread has finished a frame.
    """

    def __init__(
        self, detector: Detector, clock: Clock, done: Callable[[], object] = lambda: None
    ) -> None:
        self.skipped = 0
        self._detector, self._clock, self._done = detector, clock, done
        self._executor = None if detector.reads_features else clock.pool(1, "detector")
        self._pending: Future[DetectionResult] | None = None

    def before_encoding(self, frame: RgbdFrame, target: Target) -> None:
        """Start on a frame, if the detector needs no features and is free."""
        if self._executor is None:
            return
        if self._pending is not None:
            self.skipped += 1
            return
        self._pending = self._executor.submit(self._detect, target, frame)
        self._pending.add_done_callback(lambda _: self._done())

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
        begun_s = self._clock.monotonic_s()
        detections = detect_in_frame(self._detector, target, frame, features)
        took_s = self._clock.monotonic_s() - begun_s
        return DetectionResult(target, frame.rgb, detections, took_s * 1e3)


@dataclass(frozen=True, slots=True)
class PerceptionComponents:
    """What a perception service is made of."""

    encoder: ImageEncoder
    detector: Detector
    variance: VarianceParams


class Perception:
    """The worker: one frame per step, always the newest."""

    def __init__(self, bus: Bus, components: PerceptionComponents) -> None:
        self._components, self._clock = components, bus.clock
        self._embedding = bus.clock.lock()  # encoders of text are used by one thread at a time
        self._telemetry = PerceptionTelemetry(started_s=self._clock.monotonic_s())
        self._woken = bus.clock.event()  # by a frame, or by the detector
        self._detector_runner = DetectorRunner(components.detector, bus.clock, self._woken.set)
        self._target: Target | None = None
        self._followed: tuple[str, tuple[str, ...]] | None = None  # target and all names
        self._refused = 0
        self._frames = bus.subscribe(keys.ROBOT_RGBD, arrived=self._woken)
        self._receipts = bus.publish(keys.RGBD_RECEIPTS)
        self._searches = bus.subscribe(keys.SEARCH_STATE)
        self._fields = bus.publish(keys.FIELD)
        self._detections = bus.publish(keys.DETECTIONS)
        bus.serve(keys.EMBED_TEXT, self.embed_text)
        bus.serve(keys.EMBED_IMAGE, self.embed_image)

    def step(self, timeout_s: float) -> None:
        """Encode the newest frame, if one arrives in time; detect the target of the search.

        Returns earlier when the detector has finished. Raises ``WorkerFailed`` after many failures
        in a row.
        """
        self._woken.wait(timeout_s)
        self._woken.clear()  # before it is looked at what came
        frame = self._frames.take(0.0)
        if frame is not None:
            self._receipts.put(FrameReceipt(frame.sequence, frame.stamp_ns))
        self._update_target()
        self._log_refused()
        features = None
        if frame is not None:
            if self._target is not None:
                self._detector_runner.before_encoding(frame, self._target)
            features = self._encode(frame)
        self._detect(frame, features)
        if problem := self._telemetry.hopeless:
            raise WorkerFailed(problem)

    def health(self) -> Health:
        """Readiness, timings and counters, and the most serious problem."""
        now_s = self._clock.monotonic_s()
        telemetry, counters = self._telemetry, self._frames.counters
        return Health(
            ready=telemetry.is_ready(now_s),
            problem=telemetry.problem(now_s, keys.ROBOT_RGBD.key),
            metrics={
                **telemetry.timings,
                "frames_per_s": telemetry.encoded.rate_hz(now_s),
                "frames_missed": float(counters.missed),
                "frames_skipped": float(counters.skipped),
                "frames_refused": float(counters.refused),
                "searches_refused": float(self._searches.counters.refused),
                "detections_skipped": float(self._detector_runner.skipped),
                "frames_failed": float(telemetry.frames_failed),
                "detections_failed": float(telemetry.detections_failed),
                "out_of_memory": float(telemetry.out_of_memory),
            },
        )

    def close(self) -> None:
        """Wait for the detector's current frame."""
        self._detector_runner.close()

    def embed_text(self, request: TextRequest) -> TextEmbeddings:
        """Answer of ``perception/embed_text``; refuses unknown words with code unknown_word."""
        try:
            with self._embedding:
                return self._components.encoder.embed_text(request.texts)
        except UnknownWordError as problem:
            words = [{"word": w, "did_you_mean": list(near)} for w, near in problem.words.items()]
            raise RequestRejected("unknown_word", str(problem), {"words": words}) from problem

    def embed_image(self, request: ImageRequest) -> TextEmbeddings:
        """Answer of ``perception/embed_image``; refuses with code bad_image."""
        try:
            return self._components.encoder.embed_image(decoded(request.image))
        except ImageError as problem:
            raise RequestRejected("bad_image", str(problem)) from problem

    def _encode(self, frame: RgbdFrame) -> F16 | None:
        """Publish the frame's features and return them; None if that failed."""
        begun_s = self._clock.monotonic_s()
        try:
            features = self._components.encoder.encode(frame.rgb)
        except BackendError as problem:
            if not self._telemetry.failure:
                LOG.warning("frame %d dropped: %s", frame.sequence, problem)
            self._telemetry.frame_failed(problem)
            return None
        encoded_s = self._clock.monotonic_s()
        field = feature_field(frame, features, self._components.encoder, self._components.variance)
        self._fields.put(field)
        self._telemetry.frame_done(self._clock.monotonic_s(), encode_ms=(encoded_s - begun_s) * 1e3)
        return features

    def _detect(self, frame: RgbdFrame | None, features: F16 | None) -> None:
        """Publish finished detections, unless the target has changed since."""
        try:
            if frame is None or features is None or self._target is None:
                result = self._detector_runner.collect()
            else:
                result = self._detector_runner.after_encoding(frame, features, self._target)
        except BackendError as problem:
            if not self._telemetry.detector_failure:
                LOG.warning("detection failed on a frame: %s", problem)
            self._telemetry.detection_failed(problem)
            return
        if result is None:
            return
        self._telemetry.detection_done(result.detect_ms)
        if self._target is not None and result.target.name == self._target.name:
            self._detections.put(with_picture(result.detections, result.rgb, result.target.name))

    def _update_target(self) -> None:
        """Follow the search that the planner publishes."""
        status: SearchStatus | None = self._searches.take(0.0)
        if status is None:
            return
        if not status.target:
            self._target, self._followed = None, None
            self._telemetry.text_problem = self._telemetry.detector_failure = ""
        elif (status.target, status.named) != self._followed:
            self._followed = (status.target, status.named)
            self._target = self._resolve_target(status.target, status.named)

    def _log_refused(self) -> None:
        """One line for each message that could not be decoded, with the reason."""
        frames, searches = self._frames.counters, self._searches.counters
        refused = frames.refused + searches.refused
        if refused > self._refused:
            reason = frames.last_problem or searches.last_problem
            LOG.warning("%d messages refused, the last: %s", refused - self._refused, reason)
            self._refused = refused

    def _resolve_target(self, name: str, objects: tuple[str, ...]) -> Target:
        """The target with its queries; without them, and a problem, if the name is unknown."""
        try:
            with self._embedding:
                target = make_target(self._components.encoder, name, objects)
        except UnknownWordError as problem:
            LOG.warning("nothing can be detected as %r: %s", name, problem)
            self._telemetry.text_problem = str(problem)
            return Target(name, None)
        self._telemetry.text_problem = ""
        LOG.info("searching for %s", name)
        return target


def components_of(config: PerceptionConfig) -> PerceptionComponents:
    """As configured; raises BackendError."""
    encoder = make_encoder(config.encoder)
    detector = make_detector(config.detector, encoder)
    return PerceptionComponents(encoder, detector, VarianceParams(config.variance))


def build(bus: Bus, config: PerceptionConfig) -> Worker:
    """The configured service; StartError if encoder or detector cannot be loaded."""
    try:
        made = components_of(config)
    except BackendError as problem:
        raise StartError(str(problem)) from problem
    LOG.info("encoder %s, text space %s", made.encoder.encoder_id, made.encoder.text_space)
    LOG.info("detector %s", made.detector.detector_id)
    return Perception(bus, made)
