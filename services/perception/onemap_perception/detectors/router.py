"""COCO's names to the detector that was trained on them, all others to an open one."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np

from onemap_perception.detectors.protocol import Detection, Detector, Image
from onemap_shared.messages import TextEmbeddings


class ClosedVocabularyDetector(Detector, Protocol):
    """A detector of a closed list of names."""

    def supports(self, name: str) -> bool:
        """Whether the name is on the list."""


class RoutedDetector:
    """Implements ``Detector``: each name goes to one of the two, as in the paper."""

    reads_features = False

    def __init__(self, specialist: ClosedVocabularyDetector, generalist: Detector) -> None:
        self._specialist, self._generalist = specialist, generalist

    @property
    def detector_id(self) -> str:
        """Both ids."""
        return f"{self._specialist.detector_id}+{self._generalist.detector_id}"

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        """See ``Detector``; best first, though the scores of two networks are hardly one scale."""
        known = np.array([self._specialist.supports(name) for name in names.texts], bool)
        found: list[Detection] = []
        for detector, chosen in ((self._specialist, known), (self._generalist, ~known)):
            if chosen.any():
                own = detector.detect(image, names.only(np.flatnonzero(chosen)))
                found += [replace(detection, scale=detector.detector_id) for detection in own]
        return tuple(sorted(found, key=lambda detection: -detection.score))
