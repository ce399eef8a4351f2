"""Detections from the encoder's own calibrated scores: connected patches of one name."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from onemap_perception.detectors.protocol import Detection, Image
from onemap_perception.text.embeddings import scores
from onemap_shared.geometry import F32
from onemap_shared.messages import TextEmbeddings


@dataclass(frozen=True, slots=True)
class PatchLimits:
    """What counts as a detection.

    score_threshold: from which a patch belongs to the object. peak_threshold: that one of them
    must reach: a wrong detection costs more than a late one. min_patches: fewer connected ones are
    taken for noise. max_detections: per image and name.
    """

    score_threshold: float = 0.4
    peak_threshold: float = 0.8
    min_patches: int = 3
    max_detections: int = 8


LIMITS = PatchLimits()


class PatchDetector:
    """Implements ``Detector`` for any encoder with a calibration."""

    reads_features = True

    def __init__(self, encoder_id: str, limits: PatchLimits = LIMITS) -> None:
        self._limits = limits
        self.detector_id = f"patches/{encoder_id}"

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        """See ``Detector``."""
        if image.features is None:
            raise ValueError("the detector patches reads features, and there are none")
        rows, columns, dim = image.features.shape
        flat = scores(image.features.reshape(-1, dim).astype(np.float32), names)
        maps = flat.T.reshape(-1, rows, columns)
        height, width = image.rgb.shape[:2]
        found = [
            detection
            for name, score in zip(names.texts, maps, strict=True)
            for detection in self._detect_name(score, name, image_px=(width, height))
        ]
        return tuple(sorted(found, key=lambda detection: -detection.score))

    def _detect_name(self, score: F32, name: str, *, image_px: tuple[int, int]) -> list[Detection]:
        """Detections of one name in its score map (h, w); groups connect across diagonals."""
        above = (score >= self._limits.score_threshold).astype(np.uint8)
        count, labels, stats, _ = cv2.connectedComponentsWithStats(above, connectivity=8)
        detections = []
        for label in range(1, count):
            if stats[label, cv2.CC_STAT_AREA] < self._limits.min_patches:
                continue
            mask = labels == label
            own = np.sort(score[mask])
            if own[-1] < self._limits.peak_threshold:
                continue
            # Patches on the rim are mixed: the score is the mean of the better half.
            mean = float(own[len(own) // 2 :].mean())
            detections.append(
                Detection(name, mean, box_px(stats[label], score.shape, image_px), mask)
            )
        return sorted(detections, key=lambda each: -each.score)[: self._limits.max_detections]


def box_px(
    stats: np.ndarray, shape: tuple[int, ...], image_px: tuple[int, int]
) -> tuple[float, float, float, float]:
    """Box x0, y0, x1, y1 in pixels of an image (W, H) of a component in a grid (h, w).

    stats: its row of ``cv2.connectedComponentsWithStats``.
    """
    step_x, step_y = image_px[0] / shape[1], image_px[1] / shape[0]
    left, top = int(stats[cv2.CC_STAT_LEFT]), int(stats[cv2.CC_STAT_TOP])
    right = left + int(stats[cv2.CC_STAT_WIDTH])
    bottom = top + int(stats[cv2.CC_STAT_HEIGHT])
    return left * step_x, top * step_y, right * step_x, bottom * step_y
