"""Perception on the bus: the newest frame in, its features, variances and detections out."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass

import numpy as np

from onemap_perception.config import PerceptionConfig
from onemap_perception.detectors.protocol import Detector, Found, Seen
from onemap_perception.encoders.protocol import Encoder, UnknownWordError
from onemap_perception.factory import make_detector, make_encoder
from onemap_perception.faults import Fault, OutOfDeviceMemoryError
from onemap_perception.observation import ObservationModel, observation_variance
from onemap_perception.points import MILLIMETRE_M, DepthView, detection_points
from onemap_perception.telemetry import DETECT_MS, ENCODE_MS, FRAME_AGE_MS, Telemetry
from onemap_shared import keys
from onemap_shared.messages import (
    Detections,
    FeatureField,
    RgbdFrame,
    SearchStatus,
    TextEmbeddings,
    TextRequest,
    check_text,
)
from onemap_shared.runner import StartError
from onemap_shared.transport import Bus, Health, Refusal, Worker

LOG = logging.getLogger("onemap.perception")


@dataclass(frozen=True, slots=True)
class Parts:
    """What a perception service is made of."""

    encoder: Encoder
    detector: Detector
    observation: ObservationModel
    silent_after_s: float


@dataclass(frozen=True, slots=True)
class Sought:
    """The name the robot looks for now; ``queries`` is None if nobody can embed it."""

    name: str
    queries: TextEmbeddings | None


class Perception:
    """The worker: one frame per step, always the newest."""

    def __init__(self, bus: Bus, parts: Parts) -> None:
        self._parts = parts
        self._telemetry = Telemetry(started_s=time.monotonic())
        self._sought: Sought | None = None
        self._refused = 0
        self._frames = bus.subscribe(keys.ROBOT_RGBD)
        self._searches = bus.subscribe(keys.SEARCH_STATE)
        self._fields = bus.publish(keys.FIELD)
        self._detections = bus.publish(keys.DETECTIONS)
        bus.serve(keys.EMBED_TEXT, self.embed_text)

    def step(self, timeout_s: float) -> None:
        """Encode the newest frame, if one comes in time; look for what is being searched."""
        frame = self._frames.take(timeout_s)
        self._follow_search()
        self._log_refused()
        if frame is None:
            return
        try:
            self._see(frame)
        except Fault as problem:
            if not self._telemetry.failure:
                LOG.warning("frame %d dropped: %s", frame.sequence, problem)
            self._telemetry.frame_failed(str(problem))
            if isinstance(problem, OutOfDeviceMemoryError):
                self._telemetry.out_of_memory += 1

    def health(self) -> Health:
        """Timings, counts, and what is wrong."""
        now_s, telemetry, counters = time.monotonic(), self._telemetry, self._frames.counters
        return Health(
            ready=telemetry.working(now_s, self._parts.silent_after_s),
            problem=telemetry.problem(
                now_s,
                silent_after_s=self._parts.silent_after_s,
                camera_key=keys.ROBOT_RGBD.key,
            ),
            metrics={
                **telemetry.latest,
                "frames_per_s": telemetry.rate_hz(now_s),
                "frames_missed": float(counters.missed),
                "frames_skipped": float(counters.skipped),
                "frames_refused": float(counters.refused),
                "searches_refused": float(self._searches.counters.refused),
                "frames_failed": float(telemetry.frames_failed),
                "out_of_memory": float(telemetry.out_of_memory),
            },
        )

    def close(self) -> None:
        """Nothing is held but memory."""

    def embed_text(self, request: TextRequest) -> TextEmbeddings:
        """Answer of ``perception/embed_text``; refuses unknown words with code unknown_word."""
        texts = tuple(check_text(text) for text in request.texts)
        try:
            return self._parts.encoder.embed_text(texts)
        except UnknownWordError as problem:
            raise Refusal("unknown_word", str(problem)) from problem

    def _see(self, frame: RgbdFrame) -> None:
        begun_s = time.perf_counter()
        features = self._parts.encoder.encode(frame.rgb)
        encoded_s = time.perf_counter()
        self._fields.put(
            FeatureField(
                sequence=frame.sequence,
                stamp_ns=frame.stamp_ns,
                encoder_id=self._parts.encoder.encoder_id,
                text_space=self._parts.encoder.text_space,
                features=features,
                variance=observation_variance(
                    frame.depth_mm * MILLIMETRE_M, frame.intrinsics, self._parts.observation
                ),
                depth_mm=frame.depth_mm,
                intrinsics=frame.intrinsics,
                T_map_camera=frame.T_map_camera,
            )
        )
        age_ms = (time.time_ns() - frame.stamp_ns) * 1e-6
        detecting_s = time.perf_counter()
        if self._sought is not None:
            self._detections.put(self._detect(frame, Seen(frame.rgb, features)))
        timings = {
            ENCODE_MS: (encoded_s - begun_s) * 1e3,
            DETECT_MS: (time.perf_counter() - detecting_s) * 1e3,
            FRAME_AGE_MS: age_ms,
        }
        self._telemetry.frame_done(time.monotonic(), timings)

    def _detect(self, frame: RgbdFrame, seen: Seen) -> Detections:
        found: tuple[Found, ...] = ()
        if self._sought is not None and self._sought.queries is not None:
            found = self._parts.detector.detect(seen, self._sought.queries)
        view = DepthView(frame.depth_mm, frame.intrinsics, frame.T_map_camera)
        points_map, point_owner = detection_points(found, view)
        return Detections(
            sequence=frame.sequence,
            stamp_ns=frame.stamp_ns,
            detector_id=self._parts.detector.detector_id,
            names=tuple(thing.name for thing in found),
            boxes_px=np.array([thing.box_px for thing in found], np.float32).reshape(-1, 4),
            scores=np.array([thing.score for thing in found], np.float32),
            points_map=points_map,
            point_owner=point_owner,
        )

    def _follow_search(self) -> None:
        """Learn from the planner what is sought now."""
        status: SearchStatus | None = self._searches.take(0.0)
        if status is None:
            return
        if not status.target:
            self._sought = None
            self._telemetry.text_problem = ""
        elif self._sought is None or self._sought.name != status.target:
            self._sought = self._look_for(status.target)

    def _log_refused(self) -> None:
        """One line for each message that could not be decoded, with the reason."""
        frames, searches = self._frames.counters, self._searches.counters
        refused = frames.refused + searches.refused
        if refused > self._refused:
            reason = frames.last_problem or searches.last_problem
            LOG.warning("%d messages refused, the last: %s", refused - self._refused, reason)
            self._refused = refused

    def _look_for(self, name: str) -> Sought:
        try:
            queries = self._parts.encoder.embed_text((check_text(name),))
        except (UnknownWordError, ValueError) as problem:
            LOG.warning("nothing can be detected as %r: %s", name, problem)
            self._telemetry.text_problem = str(problem)
            return Sought(name, None)
        self._telemetry.text_problem = ""
        LOG.info("looking for %s", name)
        return Sought(name, queries)


def build(bus: Bus, config: PerceptionConfig) -> Worker:
    """The configured service; StartError if encoder or detector cannot be loaded."""
    try:
        encoder = make_encoder(config.encoder)
        detector = make_detector(config.detector, encoder)
    except Fault as problem:
        raise StartError(str(problem)) from problem
    LOG.info("encoder %s, text space %s", encoder.encoder_id, encoder.text_space)
    LOG.info("detector %s", detector.detector_id)
    observation = config.observation.model()
    return Perception(bus, Parts(encoder, detector, observation, config.silent_after_s))
