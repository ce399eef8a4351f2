"""How good the detector ``patches`` is with the encoder: found, missed, wrongly found."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from onemap_perception.detectors.patches import PatchDetector, PatchesParams
from onemap_perception.detectors.protocol import Image
from onemap_shared.geometry import F32, Bool
from onemap_shared.messages import TextEmbeddings


@dataclass(slots=True)
class DetectorMetrics:
    """Every name is looked for in every picture, with the thresholds that ship.

    A detection is right if most of what it covers is the thing. A thing counts as there if it
    fills as many patches as the detector asks for.
    """

    names: tuple[str, ...]
    limits: PatchesParams = field(default_factory=PatchesParams)
    right: int = 0
    wrong: int = 0
    there: int = 0
    found: int = 0
    pictures: int = 0

    def add(self, seen: Image, queries: TextEmbeddings, shares: F32) -> None:
        """One picture: shares (P, K) of every class in its patches; queries are ``names``."""
        assert seen.features is not None
        maps = shares.reshape(*seen.features.shape[:2], -1)
        processes: Bool = (maps > 0.5).sum(axis=(0, 1)) >= self.limits.min_patches
        hit = np.zeros_like(processes)
        for thing in PatchDetector(self.limits, "").detect(seen, queries):
            index = self.names.index(thing.name)
            if maps[..., index][thing.mask].mean() > 0.5:
                self.right += 1
                hit[index] = True
            else:
                self.wrong += 1
        self.pictures += 1
        self.there += int(processes.sum())
        self.found += int((processes & hit).sum())

    def summary(self) -> dict[str, float]:
        """precision, recall, and wrong finds per picture, over all names together."""
        return {
            "precision": self.right / max(self.right + self.wrong, 1),
            "recall": self.found / max(self.there, 1),
            "wrong_per_picture": self.wrong / max(self.pictures, 1),
        }
