"""Detections in the features of ``photo`` that both of its networks see."""

from __future__ import annotations

import numpy as np

from onemap_perception.detectors.patches import PatchDetector
from onemap_perception.detectors.protocol import Detection, Image
from onemap_perception.encoders.photo import PhotoEncoder
from onemap_perception.text.embeddings import scores, unit_rows
from onemap_shared.geometry import F32
from onemap_shared.messages import TextEmbeddings


class TwoLooksDetector:
    """Implements ``Detector``: connected patches that ``mini`` and the classifier both recognise.

    Each has its say on names that it knows, as a score of its mean over the patches that must not
    lie below the encoder's floor. One that does not know a name has none: its word would be that of
    the nearest thing that it knows. Nor is anything left out where the classifier is not asked.
    """

    reads_features = True

    def __init__(self, encoder: PhotoEncoder) -> None:
        self._encoder, self._patches = encoder, PatchDetector(encoder.encoder_id)
        self.detector_id = f"two_looks/{encoder.encoder_id}"

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        """See ``Detector``."""
        found = self._patches.detect(image, names)
        if not found:
            return ()
        features, opinion = self._encoder.looks(image.rgb)
        if opinion is None:
            return found
        classified = self._encoder.classified(names.embeddings)
        trained = np.array([len(near) == 1 for near in names.stands_for])
        sure = found
        for look, knows in ((features, trained), (opinion, classified)):
            sure = tuple(
                detection
                for detection in sure
                if not knows[row := names.texts.index(detection.name)]
                or mean_score(look, detection, names.only(np.array([row]))) >= names.floor
            )
        return sure


def mean_score(look: F32, detection: Detection, name: TextEmbeddings) -> float:
    """Score of a network's mean embedding (h, w, D) over the patches of a detection."""
    mean = look[detection.mask].mean(axis=0, keepdims=True)
    return float(scores(unit_rows(mean), name)[0, 0]) if mean.any() else 0.0
