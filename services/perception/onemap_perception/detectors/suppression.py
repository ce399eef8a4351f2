"""Names compete for what is seen: of two detections of one thing, the surer name stands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onemap_perception.detectors.protocol import Found
from onemap_shared.geometry import Bool
from onemap_shared.messages import TextEmbeddings

# Two detections cover one thing from this intersection over union on. A pillow lies within the
# bed's box and covers little of it: both stand.
SAME_THING_IOU = 0.5


def competing(queries: TextEmbeddings) -> TextEmbeddings:
    """The queries of the first text and of all that do not mean the same."""
    chosen = ~queries.same_meaning()[0]
    chosen[0] = True
    return queries.only(np.flatnonzero(chosen))


def winners(found: Sequence[Found]) -> tuple[Found, ...]:
    """The detections that no surer one of another name covers, in the order given.

    Non-maximum suppression across names, on masks. Detections of one name never compete.
    """
    return tuple(thing for thing in found if not any(_beats(rival, thing) for rival in found))


def _beats(rival: Found, thing: Found) -> bool:
    return (
        rival.name != thing.name
        and rival.scale == thing.scale
        and rival.score > thing.score
        and rival.mask.shape == thing.mask.shape
        and iou(rival.mask, thing.mask) >= SAME_THING_IOU
    )


def iou(one: Bool, other: Bool) -> float:
    """Intersection over union of two masks (h, w); 0 where both are empty."""
    union = int((one | other).sum())
    return int((one & other).sum()) / union if union else 0.0
