"""A simulated detector: boxes from the object labels, with set rates of errors.

It reads the labels, never the features, so that its errors are independent of the map's.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pydantic import Field

from onemap_perception.detectors.boxes import Box, detections_from_boxes
from onemap_perception.detectors.protocol import Detection, Image
from onemap_shared.geometry import I32, I64
from onemap_shared.messages import TextEmbeddings
from onemap_shared.names import normalised
from onemap_shared.params import Params
from onemap_simulator.rendering.label_renderer import labels_of
from onemap_simulator.scene.scene import STRUCTURE, Scene

MAX_DETECTIONS = 16  # of a name in one image
STRAY_SHARE = (0.1, 0.4)  # side of a stray box, as a share of the image's


class SimulatedDetectorParams(Params):
    """Rates of errors. Those of an open-vocabulary detector in homes, roughly."""

    min_image_share: float = Field(
        default=0.004,
        ge=0,
        le=1,
        description="Part of the image below which an object is not detected: 77 of 160 x 120 "
        "pixels, a chair at 6 m.",
    )
    miss: float = Field(
        default=0.3,
        ge=0,
        le=1,
        description="Share of the frames in which a visible object is not detected.",
    )
    confusion: float = Field(
        default=0.005,
        ge=0,
        le=1,
        description="Chance that an object is taken for something of a given other name, for good. "
        "At 0.01 the methods without consensus claimed a wrong object in 13 of 30 searches; the "
        "paper's detector alone does in 26.6 %.",
    )
    confused_frames: float = Field(
        default=0.5,
        ge=0,
        le=1,
        description="Share of the frames in which such an object is detected under that name.",
    )
    stray: float = Field(
        default=0.01,
        ge=0,
        le=1,
        description="Chance per frame and name of a box at a random place.",
    )


class SimulatedDetector:
    """Implements ``Detector`` for images of labels of one scene. Errors follow from ``seed``."""

    reads_features = False
    detector_id = "simulated"

    def __init__(self, scene: Scene, params: SimulatedDetectorParams, seed: int) -> None:
        self._params, self._seed = params, seed
        self._categories = [normalised(thing.category) for thing in scene.objects]
        self._rng = np.random.default_rng((seed, 0))
        self._taken_for: dict[str, frozenset[int]] = {}

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        """See ``Detector``."""
        height, width = image.rgb.shape[:2]
        boxes = object_boxes(labels_of(image.rgb), len(self._categories))
        visible = np.flatnonzero(boxes[:, 4] >= self._params.min_image_share * height * width)
        found = [
            box
            for name in names.texts
            for box in (*self._of_objects(name, visible, boxes), *self._stray(name, width, height))
        ]
        return detections_from_boxes(
            found, (width, height), score_threshold=0.0, max_detections=MAX_DETECTIONS
        )

    def _of_objects(self, name: str, visible: I64, boxes: I64) -> Iterator[Box]:
        confused = self._confused(normalised(name))
        for index in visible:
            if self._categories[index] == normalised(name):
                rate, scores = 1 - self._params.miss, (0.6, 0.95)
            elif index in confused:
                rate, scores = self._params.confused_frames, (0.5, 0.85)
            else:
                continue
            if self._rng.random() < rate:
                x0, y0, x1, y1 = (float(corner) for corner in boxes[index, :4])
                yield Box(name, float(self._rng.uniform(*scores)), (x0, y0, x1, y1))

    def _stray(self, name: str, width: int, height: int) -> Iterator[Box]:
        if self._rng.random() >= self._params.stray:
            return
        size = self._rng.uniform(*STRAY_SHARE, 2) * (width, height)
        x, y = self._rng.uniform(0, 1, 2) * ((width, height) - size)
        corners = (float(x), float(y), float(x + size[0]), float(y + size[1]))
        yield Box(name, float(self._rng.uniform(0.5, 0.7)), corners)

    def _confused(self, name: str) -> frozenset[int]:
        """Objects that are taken for this name, whatever was asked before."""
        if name not in self._taken_for:
            rng = np.random.default_rng((self._seed, 1, *name.encode()))
            drawn = np.flatnonzero(rng.random(len(self._categories)) < self._params.confusion)
            self._taken_for[name] = frozenset(
                int(index) for index in drawn if self._categories[index] not in STRUCTURE
            )
        return self._taken_for[name]


def object_boxes(labels: I32, objects: int) -> I64:
    """(objects, 5): x0, y0, x1, y1 in pixels around each object's labels, and their number."""
    height, width = labels.shape
    boxes = np.zeros((objects, 5), np.int64)
    v, u = np.nonzero(labels >= 0)
    owner = labels[v, u]
    boxes[:, 4] = np.bincount(owner, minlength=objects)
    lower = np.full((objects, 2), max(height, width))
    for axis, at in enumerate((u, v)):
        np.minimum.at(lower[:, axis], owner, at)
        np.maximum.at(boxes[:, 2 + axis], owner, at + 1)
    boxes[:, :2] = np.where(boxes[:, 4:] > 0, lower, 0)
    return boxes
