"""Images, names and checks that the tests of the detectors share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onemap_perception.detectors.protocol import Detection, Image
from onemap_shared.messages import TextEmbeddings


def names(*texts: str) -> TextEmbeddings:
    rows = np.ones((len(texts), 1), np.float32)
    none = np.zeros((0, 1), np.float32)
    return TextEmbeddings("e", "s", texts, rows, none, np.zeros((len(texts), 0), np.uint8), 1.0)


def noise(height: int = 48, width: int = 64) -> Image:
    rgb = np.random.default_rng(0).integers(0, 256, (height, width, 3)).astype(np.uint8)
    return Image(rgb)


def inside(detections: Sequence[Detection], image_px: tuple[int, int]) -> bool:
    """Whether boxes, masks and scores are possible for an image (W, H)."""
    width, height = image_px
    return all(
        0 <= detection.box_px[0] < detection.box_px[2] <= width
        and 0 <= detection.box_px[1] < detection.box_px[3] <= height
        and detection.mask.shape == (height, width)
        and detection.mask.any()
        and 0 <= detection.score <= 1
        for detection in detections
    )
