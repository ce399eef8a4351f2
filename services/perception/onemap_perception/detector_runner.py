"""The detector at work: beside the encoder where it can do without it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from onemap_perception.backproject import DepthView, detection_points
from onemap_perception.detectors.protocol import Detector, Found, Seen
from onemap_perception.detectors.suppression import winners
from onemap_shared.geometry import F16
from onemap_shared.messages import Detections, RgbdFrame, TextEmbeddings


@dataclass(frozen=True, slots=True)
class Sought:
    """The name the robot looks for now.

    queries: of that name and, after it, of the search's other names, which compete with it for
    what is seen; None if nobody can embed the name.
    """

    name: str
    queries: TextEmbeddings | None


@dataclass(frozen=True, slots=True)
class Looked:
    """What was found of ``sought`` in one frame, and how long that took."""

    sought: Sought
    detections: Detections
    detect_ms: float


class Lookout:
    """Runs the detector on one frame at a time. Used from one thread.

    A detector that reads the encoder's features runs after it, in the caller's thread. Any
    other has a thread of its own and sees a frame while the encoder does; frames that come
    before it is done are passed over and counted, so that a slow detector never holds up the map.
    """

    def __init__(self, detector: Detector, clock_s: Callable[[], float]) -> None:
        self.skipped = 0
        self._detector = detector
        self._clock_s = clock_s
        self._beside = None if detector.reads_features else ThreadPoolExecutor(1, "detector")
        self._running: Future[Looked] | None = None

    def before_encoding(self, frame: RgbdFrame, sought: Sought) -> None:
        """Begin with a frame, if the detector needs no features and is free."""
        if self._beside is None:
            return
        if self._running is not None:
            self.skipped += 1
            return
        self._running = self._beside.submit(self._look, sought, frame)

    def after_encoding(self, frame: RgbdFrame, features: F16, sought: Sought) -> Looked | None:
        """What was found: in this frame, or in an earlier one that is done by now."""
        if self._beside is None:
            return self._look(sought, frame, features)
        return self.collect()

    def collect(self) -> Looked | None:
        """What the detector's own thread has found since, if it is done; raises what it raised."""
        if self._running is None or not self._running.done():
            return None
        done, self._running = self._running, None
        return done.result()

    def close(self) -> None:
        """Wait for the frame that is being looked at."""
        if self._beside is not None:
            self._beside.shutdown(cancel_futures=True)

    def _look(self, sought: Sought, frame: RgbdFrame, features: F16 | None = None) -> Looked:
        begun_s = self._clock_s()
        detections = look(self._detector, sought, frame, features)
        return Looked(sought, detections, (self._clock_s() - begun_s) * 1e3)


def look(detector: Detector, sought: Sought, frame: RgbdFrame, features: F16 | None) -> Detections:
    """Run the detector on a frame and place what it found on the map."""
    found: tuple[Found, ...] = ()
    if sought.queries is not None:
        found = winners(detector.detect(Seen(frame.rgb, features), sought.queries))
    view = DepthView(frame.depth_mm, frame.intrinsics, frame.T_map_camera)
    points_map, point_owner = detection_points(found, view)
    return Detections(
        sequence=frame.sequence,
        stamp_ns=frame.stamp_ns,
        detector_id=detector.detector_id,
        names=tuple(thing.name for thing in found),
        boxes_px=np.array([thing.box_px for thing in found], np.float32).reshape(-1, 4),
        scores=np.array([thing.score for thing in found], np.float32),
        points_map=points_map,
        point_owner=point_owner,
    )
