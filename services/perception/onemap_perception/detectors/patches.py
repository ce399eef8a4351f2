"""Detections out of the encoder's own calibrated patch scores: connected patches that agree."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from onemap_perception.detectors.protocol import Detection, Image
from onemap_perception.text.scores import scores
from onemap_shared.geometry import F32, I32, Bool
from onemap_shared.messages import TextEmbeddings


@dataclass(frozen=True, slots=True)
class PatchThresholds:
    """score: from which a patch belongs to the thing; core: what at least one patch of it must
    reach; patches: how many at least; detections: how many at most, per image and name."""

    score: float = 0.4
    core: float = 0.8
    patches: int = 3
    detections: int = 8


class PatchDetector:
    """Implements ``Detector`` for any encoder with a calibration."""

    reads_features = True

    def __init__(self, thresholds: PatchThresholds, encoder_id: str) -> None:
        self._thresholds = thresholds
        self._id = f"patches/{encoder_id}"

    @property
    def detector_id(self) -> str:
        """``patches/`` and the encoder's id."""
        return self._id

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
            for detection in self._of_one_name(score, name, image_px=(width, height))
        ]
        return tuple(sorted(found, key=lambda detection: -detection.score))

    def _of_one_name(self, score: F32, name: str, *, image_px: tuple[int, int]) -> list[Detection]:
        limits = self._thresholds
        labels = components(score >= limits.score)
        detections = []
        for label in range(1, int(labels.max(initial=0)) + 1):
            mask = labels == label
            if mask.sum() < limits.patches or score[mask].max() < limits.core:
                continue
            # Patches on the rim are mixed: the better half says how sure the thing is.
            best = np.sort(score[mask])[mask.sum() // 2 :]
            detections.append(Detection(name, float(best.mean()), box_px(mask, image_px), mask))
        return sorted(detections, key=lambda detection: -detection.score)[: limits.detections]


def components(wanted: Bool) -> I32:
    """Label (h, w) int32 of each wanted patch's connected group, diagonals included; 0 = not."""
    labels = np.zeros(wanted.shape, np.int32)
    cv2.connectedComponents(wanted.astype(np.uint8), labels, connectivity=8, ltype=cv2.CV_32S)
    return labels


def box_px(mask: Bool, image_px: tuple[int, int]) -> tuple[float, float, float, float]:
    """The box around a mask (h, w) laid over an image of (W, H) pixels: x0, y0, x1, y1."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    step_x, step_y = image_px[0] / mask.shape[1], image_px[1] / mask.shape[0]
    return (
        float(columns[0] * step_x),
        float(rows[0] * step_y),
        float((columns[-1] + 1) * step_x),
        float((rows[-1] + 1) * step_y),
    )
