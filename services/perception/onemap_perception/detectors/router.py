"""COCO's names to the detector that was trained on them, all others to an open one."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from onemap_perception.detectors.protocol import Detector, Found, Seen
from onemap_shared.messages import TextEmbeddings


class Specialist(Detector, Protocol):
    """A detector of a closed list of names."""

    def knows(self, name: str) -> bool:
        """Whether the name is on the list."""


class RoutedDetector:
    """Implements ``Detector``: each name goes to one of the two, as in the paper."""

    reads_features = False

    def __init__(self, specialist: Specialist, generalist: Detector) -> None:
        self._specialist, self._generalist = specialist, generalist

    @property
    def detector_id(self) -> str:
        """Both ids."""
        return f"{self._specialist.detector_id}+{self._generalist.detector_id}"

    def detect(self, seen: Seen, names: TextEmbeddings) -> tuple[Found, ...]:
        """See ``Detector``; best first, though the scores of two networks are hardly one scale."""
        known = np.array([self._specialist.knows(name) for name in names.texts], bool)
        found: list[Found] = []
        for detector, chosen in ((self._specialist, known), (self._generalist, ~known)):
            if chosen.any():
                found += detector.detect(seen, only(names, np.flatnonzero(chosen)))
        return tuple(sorted(found, key=lambda thing: -thing.score))


def only(names: TextEmbeddings, rows: np.ndarray) -> TextEmbeddings:
    """The queries of these rows (N,) int."""
    return TextEmbeddings(
        encoder_id=names.encoder_id,
        text_space=names.text_space,
        texts=tuple(names.texts[row] for row in rows),
        embeddings=names.embeddings[rows],
        neutral=names.neutral,
        neutral_mask=names.neutral_mask[rows],
        temperature=names.temperature,
        floor=names.floor,
        nearest=tuple(names.nearest[row] for row in rows) if names.nearest else (),
    )
