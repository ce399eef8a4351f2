"""Detection of the search's target in one frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onemap_perception.backproject import backproject_detections
from onemap_perception.detectors.protocol import Detection, Detector, Image
from onemap_perception.detectors.suppression import distinct_queries, suppress_overlaps
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.errors import UnknownWordError
from onemap_shared.geometry import F16
from onemap_shared.messages import Detections, RgbdFrame, TextEmbeddings


@dataclass(frozen=True, slots=True)
class Target:
    """The object that is searched for now.

    queries: of its name and, after it, of the search's other names that do not mean the same:
    they compete for what is detected. None if the name cannot be embedded.
    """

    name: str
    queries: TextEmbeddings | None


def make_target(encoder: Encoder, name: str, objects: Sequence[str]) -> Target:
    """The target of a search for ``objects``; raises UnknownWordError if ``name`` is unknown.

    Other names that cannot be embedded do not compete.
    """
    names = tuple(dict.fromkeys((name, *objects)))
    try:
        queries = encoder.embed_text(names)
    except UnknownWordError as problem:
        queries = encoder.embed_text(
            (name, *(other for other in names[1:] if other not in problem.words))
        )
    return Target(name, distinct_queries(queries))


def detect_in_frame(
    detector: Detector, target: Target, frame: RgbdFrame, features: F16 | None
) -> Detections:
    """Detections of the target and its competitors, with their points in the map.

    features (h, w, D) float16 of the frame, for a detector that reads them.
    """
    found: tuple[Detection, ...] = ()
    if target.queries is not None:
        found = suppress_overlaps(detector.detect(Image(frame.rgb, features), target.queries))
    points_map, point_owner = backproject_detections(found, frame)
    return Detections(
        sequence=frame.sequence,
        stamp_ns=frame.stamp_ns,
        detector_id=detector.detector_id,
        names=tuple(detection.name for detection in found),
        boxes_px=np.array([detection.box_px for detection in found], np.float32).reshape(-1, 4),
        scores=np.array([detection.score for detection in found], np.float32),
        points_map=points_map,
        point_owner=point_owner,
        independent=not detector.reads_features,
    )
