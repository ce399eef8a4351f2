"""Detection of the search's target in one frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from onemap_perception.detectors.protocol import Detection, Detector, Image
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.errors import UnknownWordError
from onemap_shared.geometry import F16, F32, I32, U8, Bool, transform
from onemap_shared.messages import MAX_PICTURE_BYTES, Detections, RgbdFrame, TextEmbeddings
from onemap_shared.names import same_name


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


# From this intersection over union on, two detections are of one object. A pillow lies within the
# bed's box and covers little of it: both are kept.
SUPPRESSION_IOU = 0.5


def distinct_queries(queries: TextEmbeddings) -> TextEmbeddings:
    """The query of the first text, and those of all texts that do not mean the same."""
    chosen = ~queries.same_meaning()[0]
    chosen[0] = True
    return queries.only(np.flatnonzero(chosen))


def suppress_overlaps(found: Sequence[Detection]) -> tuple[Detection, ...]:
    """The detections without a better one of another name on the same object, order kept.

    Masks are compared; detections of one name do not suppress each other.
    """
    return tuple(
        detection
        for detection in found
        if not any(_suppresses(rival, detection) for rival in found)
    )


def _suppresses(rival: Detection, detection: Detection) -> bool:
    return (
        rival.name != detection.name
        and rival.scale == detection.scale
        and rival.score > detection.score
        and rival.mask.shape == detection.mask.shape
        and iou(rival.mask, detection.mask) >= SUPPRESSION_IOU
    )


def iou(one: Bool, other: Bool) -> float:
    """Intersection over union of two masks (h, w); 0 where both are empty."""
    union = int((one | other).sum())
    return int((one & other).sum()) / union if union else 0.0


MILLIMETRE_M = np.float32(1e-3)
MAX_POINTS = 64  # per detection: enough for the planner's consensus, small on the wire
MAX_DEPTH_SPREAD_M = 0.6  # half the depth of a sofa; what lies deeper is behind the object


def backproject_detections(detections: Sequence[Detection], frame: RgbdFrame) -> tuple[F32, I32]:
    """Surface points (P, 3) float32 of all detections in the map frame and their owners (P,).

    Per detection at most ``MAX_POINTS``, evenly spread over its mask, without those whose depth
    is more than ``MAX_DEPTH_SPREAD_M`` from the detection's median.
    """
    points = [np.zeros((0, 3), np.float32)]
    owners = [np.zeros(0, np.int32)]
    for index, detection in enumerate(detections):
        own = _backproject_mask(detection.mask, frame)
        points.append(own)
        owners.append(np.full(len(own), index, np.int32))
    return np.concatenate(points), np.concatenate(owners)


def _backproject_mask(mask: Bool, frame: RgbdFrame) -> F32:
    """Points (N, 3) float32 under one mask (h, w) that is laid over the whole image."""
    height, width = frame.depth_mm.shape
    row_of = np.arange(height) * mask.shape[0] // height
    column_of = np.arange(width) * mask.shape[1] // width
    covered = mask[row_of[:, None], column_of[None, :]] & (frame.depth_mm > 0)
    v, u = np.nonzero(covered)
    if len(v) == 0:
        return np.zeros((0, 3), np.float32)
    depth_m = frame.depth_mm[v, u] * MILLIMETRE_M
    near = np.flatnonzero(np.abs(depth_m - np.median(depth_m)) <= MAX_DEPTH_SPREAD_M)
    kept = near[np.linspace(0, len(near) - 1, min(MAX_POINTS, len(near))).round().astype(int)]
    x, y = frame.intrinsics.x_at(u[kept]), frame.intrinsics.y_at(v[kept])
    points_camera = np.stack([x, y, np.ones(len(kept))], axis=1)
    points_camera *= depth_m[kept, None]
    points_map: F32 = transform(frame.T_map_camera, points_camera).astype(np.float32)
    return points_map


MAX_SIDE_PX = 640
QUALITY = 80  # percent


def with_picture(detections: Detections, rgb: U8, target: str) -> Detections:
    """The detections with the frame (H, W, 3) as a picture, if the target is among them.

    Boxes stay in pixels of the frame; ``picture_scale`` takes them to the picture.
    """
    if not any(same_name(name, target) for name in detections.names):
        return detections
    picture, scale = encode_picture(rgb)
    return replace(detections, picture=picture, picture_scale=scale)


def encode_picture(rgb: U8) -> tuple[bytes, float]:
    """JPEG of an image (H, W, 3), at most ``MAX_SIDE_PX`` on its longer side, and its scale.

    Simulated frames of 640 x 480 take 17 to 42 kB, 30 kB in the median, and 1 ms on one core.
    Empty, with scale 1, if it is too large even so, as noise may be.
    """
    height, width = rgb.shape[:2]
    scale = min(1.0, MAX_SIDE_PX / max(height, width))
    bgr = cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR)
    if scale < 1.0:
        size = (max(round(width * scale), 1), max(round(height * scale), 1))
        bgr = cv2.resize(bgr, size, interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    return (data.tobytes(), scale) if data.size <= MAX_PICTURE_BYTES else (b"", 1.0)
