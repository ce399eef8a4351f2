"""Non-maximum suppression across names: one object keeps the name with the best score."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onemap_perception.detectors.protocol import Detection
from onemap_shared.geometry import Bool
from onemap_shared.messages import TextEmbeddings

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
