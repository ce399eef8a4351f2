"""Each name goes to one of two detectors."""

from __future__ import annotations

import numpy as np

from onemap_perception.detectors.boxes import RoutedDetector
from onemap_perception.detectors.protocol import Detection, Image
from onemap_shared.messages import TextEmbeddings
from tests.perception.detectors.samples import names, noise


class OneEach:
    """One detection of every name, with a fixed score."""

    reads_features = False

    def __init__(self, detector_id: str, score: float, supported: tuple[str, ...] = ()) -> None:
        self.detector_id = detector_id
        self.asked: list[tuple[str, ...]] = []
        self._score, self._supported = score, supported

    def supports(self, name: str) -> bool:
        return name in self._supported

    def detect(self, image: Image, wanted: TextEmbeddings) -> tuple[Detection, ...]:
        self.asked.append(wanted.texts)
        mask = np.ones((1, 1), bool)
        return tuple(Detection(name, self._score, (0, 0, 1, 1), mask) for name in wanted.texts)


def test_each_name_goes_to_one_detector_and_the_best_come_first() -> None:
    closed, open_vocabulary = OneEach("closed", 0.5, ("tv", "cup")), OneEach("open", 0.8)
    routed = RoutedDetector(closed, open_vocabulary)
    found = routed.detect(noise(), names("tv", "unicorn", "cup"))
    assert (closed.asked, open_vocabulary.asked) == ([("tv", "cup")], [("unicorn",)])
    assert [each.name for each in found] == ["unicorn", "tv", "cup"]
    assert [each.scale for each in found] == ["open", "closed", "closed"]
    assert routed.detector_id == "closed+open"


def test_a_detector_without_a_name_does_not_run() -> None:
    closed, open_vocabulary = OneEach("closed", 0.5, ("tv",)), OneEach("open", 0.8)
    RoutedDetector(closed, open_vocabulary).detect(noise(), names("tv"))
    assert open_vocabulary.asked == []
