"""Detectors whose networks answer with boxes: which count, and which pixels they stand for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from onemap_perception.config import BoxParams
from onemap_perception.detectors.protocol import Detection, Detector, Image
from onemap_shared.geometry import U8, Bool
from onemap_shared.messages import TextEmbeddings

# An object rarely fills its box: the corners show the background. This share of each side, around
# the middle of the box, stands for the object; the median of the depth removes the rest.
INNER_SHARE = 0.6
MAX_DETECTIONS = 16  # per image and name


@dataclass(frozen=True, slots=True)
class Box:
    """A box of a network: corners x0, y0, x1, y1 in pixels, possibly beyond the image."""

    name: str
    score: float
    corners_px: tuple[float, float, float, float]


def detections_from_boxes(
    boxes: Iterable[Box],
    image_px: tuple[int, int],
    *,
    score_threshold: float,
    max_detections: int,
) -> tuple[Detection, ...]:
    """Detections of the boxes from the threshold on, clipped to the image (W, H), best first.

    At most ``max_detections`` of a name.
    """
    width, height = image_px
    accepted = sorted(
        (box for box in boxes if box.score >= score_threshold), key=lambda box: -box.score
    )
    detections: list[Detection] = []
    count: Counter[str] = Counter()
    for box in accepted:
        if count[box.name] == max_detections:
            continue
        x0, x1 = np.clip((box.corners_px[0], box.corners_px[2]), 0, width)
        y0, y1 = np.clip((box.corners_px[1], box.corners_px[3]), 0, height)
        if not (x1 > x0 and y1 > y0):  # also refuses NaN
            continue
        corners = (float(x0), float(y0), float(x1), float(y1))
        count[box.name] += 1
        detections.append(
            Detection(box.name, float(min(box.score, 1.0)), corners, inner_mask(corners, image_px))
        )
    return tuple(detections)


def inner_mask(corners_px: tuple[float, float, float, float], image_px: tuple[int, int]) -> Bool:
    """The middle of a box as pixels (H, W) bool of an image (W, H): one pixel at least."""
    width, height = image_px
    x0, y0, x1, y1 = corners_px
    columns = _inner(x0, x1, width)
    rows = _inner(y0, y1, height)
    mask = np.zeros((height, width), bool)
    mask[rows, columns] = True
    return mask


def _inner(low: float, high: float, size: int) -> slice:
    middle, half = (low + high) / 2, (high - low) / 2 * INNER_SHARE
    first = min(int(middle - half), size - 1)
    return slice(max(first, 0), max(int(np.ceil(middle + half)), first + 1))


class BoxNetwork(Protocol):
    """Finds boxes of named objects in an image."""

    @property
    def network_id(self) -> str:
        """The backend and a digest of the weights."""

    def supports(self, name: str, /) -> bool:
        """Whether the network can find objects of this name."""

    def boxes(self, rgb: U8, names: Sequence[str], score_threshold: float) -> list[Box]:
        """Boxes in an image (H, W, 3) of the names it supports, from the threshold on."""


class BoxDetector:
    """Implements ``Detector`` for a network of boxes."""

    reads_features = False

    def __init__(self, network: BoxNetwork, params: BoxParams) -> None:
        self.detector_id = network.network_id
        self._network = network
        self._params = params

    def supports(self, name: str) -> bool:
        """Whether objects of this name can be found."""
        return self._network.supports(name)

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        """See ``Detector``; there are no detections of names the network does not support."""
        supported = [name for name in names.texts if self.supports(name)]
        if not supported:
            return ()
        height, width = image.rgb.shape[:2]
        return detections_from_boxes(
            self._network.boxes(image.rgb, supported, self._params.score_threshold),
            (width, height),
            score_threshold=self._params.score_threshold,
            max_detections=MAX_DETECTIONS,
        )


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
