"""Routes COCO's names to the detector trained on them, all others to an open-vocabulary one."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np

from onemap_perception.detectors.protocol import Detection, Detector, Image
from onemap_shared.messages import TextEmbeddings


class ClosedVocabularyDetector(Detector, Protocol):
    """A detector of a fixed list of names."""

    def supports(self, name: str, /) -> bool:
        """Whether the name is on the list."""


class RoutedDetector:
    """Implements ``Detector``: each name goes to one of the two, as in the paper."""

    reads_features = False

    def __init__(self, closed: ClosedVocabularyDetector, open_vocabulary: Detector) -> None:
        self.detector_id = f"{closed.detector_id}+{open_vocabulary.detector_id}"
        self._closed, self._open_vocabulary = closed, open_vocabulary

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        """See ``Detector``; best first, though scores of two networks are hardly one scale."""
        supported = np.array([self._closed.supports(name) for name in names.texts], bool)
        found: list[Detection] = []
        for detector, chosen in ((self._closed, supported), (self._open_vocabulary, ~supported)):
            if chosen.any():
                own = detector.detect(image, names.only(np.flatnonzero(chosen)))
                found += [replace(detection, scale=detector.detector_id) for detection in own]
        return tuple(sorted(found, key=lambda detection: -detection.score))
