"""Precision and recall of the detector ``patches`` with the encoder."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from onemap_perception.detectors.patches import PatchDetector, PatchLimits
from onemap_perception.detectors.protocol import Image
from onemap_shared.geometry import F32, Bool
from onemap_shared.messages import TextEmbeddings


@dataclass(slots=True)
class DetectorMetrics:
    """Counts over images, in each of which every name is searched with the default thresholds.

    A detection is correct if its class fills most of its mask. A class is present if it fills as
    many patches as the detector requires.
    """

    names: tuple[str, ...]
    params: PatchLimits = field(default_factory=PatchLimits)
    correct: int = 0
    wrong: int = 0
    instances: int = 0
    found: int = 0
    images: int = 0

    def add(self, image: Image, queries: TextEmbeddings, shares: F32) -> None:
        """Add an image: shares (P, K) of every class in its patches; queries are ``names``."""
        assert image.features is not None
        maps = shares.reshape(*image.features.shape[:2], -1)
        present: Bool = (maps > 0.5).sum(axis=(0, 1)) >= self.params.min_patches
        hit = np.zeros_like(present)
        for detection in PatchDetector("", self.params).detect(image, queries):
            index = self.names.index(detection.name)
            if maps[..., index][detection.mask].mean() > 0.5:
                self.correct += 1
                hit[index] = True
            else:
                self.wrong += 1
        self.images += 1
        self.instances += int(present.sum())
        self.found += int((present & hit).sum())

    def summary(self) -> dict[str, float]:
        """Precision, recall and wrong detections per image, over all names."""
        return {
            "precision": self.correct / max(self.correct + self.wrong, 1),
            "recall": self.found / max(self.instances, 1),
            "wrong_per_picture": self.wrong / max(self.images, 1),
        }
