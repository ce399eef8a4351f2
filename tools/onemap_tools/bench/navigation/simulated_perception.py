"""A simulated encoder and detector, from the object labels that the simulator renders.

The image holds labels in place of colours (``label_renderer``). A patch's feature is the mean of
its objects' text embeddings, blurred, with errors of set size; ``UNCALIBRATED`` adds a component
that all images have in common and another that all texts have, as the encoders of the CLIP family.
The detector reads the labels, never the features, so that its errors are independent of the map's.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np

from onemap_perception.detectors.boxes import Box, detections_from_boxes
from onemap_perception.detectors.protocol import Detection, Image
from onemap_perception.errors import ImageError
from onemap_perception.text.competition import Competition
from onemap_perception.text.embeddings import unit_rows
from onemap_perception.text.queries import QueryEncoder
from onemap_perception.text.vocabulary import (
    EmbeddingTable,
    Vocabulary,
    load_calibration,
    load_table,
    load_vocabulary,
)
from onemap_shared.geometry import F16, F32, I32, I64, U8
from onemap_shared.messages import TextEmbeddings
from onemap_shared.names import normalised
from onemap_simulator.rendering.label_renderer import labels_of
from onemap_simulator.scene.scene import STRUCTURE, Scene

CONFUSABLE = 5  # an object is confused with one of this many categories most like its own
MAX_DETECTIONS = 16  # of a name in one image
STRAY_SHARE = (0.1, 0.4)  # side of a stray box, as a share of the image's


@dataclass(frozen=True, slots=True)
class SimulatedFeatureParams:
    """How the features differ from the text embeddings of what the camera sees.

    patch_px: pixels per patch side; 40 x 30 patches, as many as mini's. dimension: numbers per
    feature, the first principal components of mini's 384: the cosines between its classes change
    by 0.03 on average, 0.10 at most; the map is fused and queried in a fifth of the time. noise:
    length of the random vector added to each patch's unit feature, new in each frame: fusion
    averages it out. object_noise: the same of each object, for good: fusion does not help.
    confusion: share of the objects that look like another, similar category, as many as the pixels
    that mini gets wrong. blur_patches: standard deviation; features mix at the borders of objects.
    common: length of the component that all features share, and of that of all texts; 0: scores
    are calibrated against neutral words, as with mini. common_cosine: between the two components,
    the gap between images and texts.
    """

    patch_px: int = 4
    dimension: int = 64
    noise: float = 1.0
    object_noise: float = 0.5
    confusion: float = 0.06
    blur_patches: float = 0.7
    common: float = 0.0
    common_cosine: float = 0.2


# Of CLIP's kind: any text has a cosine near 0.25 with any patch, the right one 0.1 more.
UNCALIBRATED = SimulatedFeatureParams(common=1.2)


@dataclass(frozen=True, slots=True)
class SimulatedDetectorParams:
    """Rates of errors. Those of an open-vocabulary detector in homes, roughly.

    min_image_share: part of the image below which an object is not detected: 77 of 160 x 120
    pixels, a chair at 6 m. miss: share of the frames in which a visible object is not detected.
    confusion: chance that an object is taken for something of a given other name, for good; at
    0.01 the methods without consensus claimed a wrong object in 13 of 30 searches, and the paper's
    detector alone does in 26.6 %. confused_frames: share of the frames in which such an object is
    detected under that name. stray: chance per frame and name of a box at a random place.
    """

    min_image_share: float = 0.004
    miss: float = 0.3
    confusion: float = 0.005
    confused_frames: float = 0.5
    stray: float = 0.01


class SimulatedEncoder:
    """Implements ``Encoder`` for images of labels of one scene. Errors follow from ``rng``."""

    def __init__(
        self, scene: Scene, folder: Path, params: SimulatedFeatureParams, rng: np.random.Generator
    ) -> None:
        self._params, self._rng = params, rng
        vocabulary = load_vocabulary(folder)
        self._table = _table(folder, params.dimension)
        self._queries = QueryEncoder(vocabulary, self._table, load_calibration(folder))
        self._raw = QueryEncoder(vocabulary, self._table, load_calibration(folder), raw=True)
        self._image_mean, self._text_mean = common_components(params, rng)
        self._competition = Competition(vocabulary, self._common_rows) if params.common else None
        self._objects = object_features(scene, self._class_rows(scene), params, rng)

    @property
    def encoder_id(self) -> str:
        """See ``Encoder``."""
        return f"simulated-{'uncalibrated' if self._params.common else 'calibrated'}"

    @property
    def text_space(self) -> str:
        """See ``Encoder``."""
        return f"simulated-{self._params.dimension}"

    def encode(self, rgb: U8) -> F16:
        """See ``Encoder``; rgb holds ``label_colours``."""
        params = self._params
        shares = label_shares(labels_of(rgb), params.patch_px, len(self._objects))
        rows, columns, _ = shares.shape
        mixed: F32 = (shares.reshape(rows * columns, -1) @ self._objects).reshape(rows, columns, -1)
        if params.blur_patches > 0:
            mixed = np.asarray(cv2.GaussianBlur(mixed, (0, 0), params.blur_patches), np.float32)
        error = self._rng.standard_normal(mixed.shape, np.float32)
        features = _unit(mixed) + np.float32(params.noise / np.sqrt(params.dimension)) * error
        shared = np.float32(params.common) * self._image_mean
        result: F16 = _unit(_unit(features) + shared).astype(np.float16)
        return result

    def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
        """See ``Encoder``: calibrated as mini, or if ``common`` is not 0 without labels."""
        ids = {"encoder_id": self.encoder_id, "text_space": self.text_space}
        queries = self._queries.queries(texts, **ids)
        if self._competition is None:
            return queries
        return self._competition.queries(texts, self._common_rows(texts), **ids, floor=0.0)

    def embed_image(self, rgb: U8) -> TextEmbeddings:  # noqa: ARG002
        """See ``ImageEncoder``: labels show nothing of a picture."""
        raise ImageError("a simulated encoder takes no pictures: search by a name")

    def _common_rows(self, texts: Sequence[str]) -> F32:
        """Embeddings (N, D) of texts, with what all of them have in common."""
        own = self._raw.queries(texts, encoder_id="", text_space="").embeddings
        return _unit(own + np.float32(self._params.common) * self._text_mean)

    def _class_rows(self, scene: Scene) -> F32:
        """Embeddings (objects, D) of the objects' categories."""
        categories = [thing.category for thing in scene.objects]
        return self._queries.queries(categories, encoder_id="", text_space="").embeddings


@lru_cache(maxsize=4)
def _table(folder: Path, dimension: int) -> EmbeddingTable:
    return compact_table(load_table(folder), load_vocabulary(folder), dimension)


def compact_table(table: EmbeddingTable, vocabulary: Vocabulary, dimension: int) -> EmbeddingTable:
    """The table in the principal components (not centred) of the classes and neutral words."""
    names = [word for entry in vocabulary.classes for word in entry.aliases]
    rows = table.embed((*names, *vocabulary.neutral))
    components = np.linalg.svd(rows, full_matrices=False)[2][:dimension]
    return EmbeddingTable(table.words, unit_rows(table.embed(table.words) @ components.T))


def common_components(params: SimulatedFeatureParams, rng: np.random.Generator) -> tuple[F32, F32]:
    """Unit vectors (D,) that all features and all texts share, with the set cosine."""
    first, second = _unit(rng.standard_normal((2, params.dimension)).astype(np.float32))
    across = _unit(second - (first @ second) * first)
    cosine = params.common_cosine
    text: F32 = np.float32(cosine) * first + np.float32(np.sqrt(1 - cosine**2)) * across
    return first, text


def object_features(
    scene: Scene, rows: F32, params: SimulatedFeatureParams, rng: np.random.Generator
) -> F32:
    """Feature (objects, D) of each object: its category's row (objects, D) with lasting errors.

    A share of the objects, never of the structure, has the row of a similar category in the scene.
    """
    cosines = rows @ rows.T
    looks = rows.copy()
    for index, thing in enumerate(scene.objects):
        if thing.category in STRUCTURE or rng.random() >= params.confusion:
            continue
        others = [
            other
            for other in np.argsort(-cosines[index], kind="stable")
            if scene.objects[other].category != thing.category
        ]
        similar = list({scene.objects[other].category: other for other in others[::-1]}.values())
        looks[index] = rows[sorted(similar, key=others.index)[int(rng.integers(CONFUSABLE))]]
    error = rng.standard_normal(rows.shape, np.float32)
    return _unit(looks + np.float32(params.object_noise / np.sqrt(params.dimension)) * error)


def label_shares(labels: I32, patch_px: int, objects: int) -> F32:
    """Share (h, w, objects) of each patch's pixels that show an object; H, W are multiples."""
    height, width = labels.shape
    rows, columns = height // patch_px, width // patch_px
    patch = (np.arange(height) // patch_px)[:, None] * columns + np.arange(width) // patch_px
    seen = (labels >= 0) & (labels < objects)  # others are of damaged images
    counts = np.bincount(
        patch[seen] * objects + labels[seen], minlength=rows * columns * objects
    ).reshape(rows, columns, objects)
    shares: F32 = counts.astype(np.float32) / np.float32(patch_px**2)
    return shares


def _unit(rows: F32) -> F32:
    """Rows (..., D) of length one; zeros stay zeros."""
    lengths = np.linalg.norm(rows, axis=-1, keepdims=True)
    scaled: F32 = rows / np.maximum(lengths, np.float32(1e-6))
    return scaled


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
    v, u = np.nonzero((labels >= 0) & (labels < objects))  # others are of damaged images
    owner = labels[v, u]
    boxes[:, 4] = np.bincount(owner, minlength=objects)
    lower = np.full((objects, 2), max(height, width))
    for axis, at in enumerate((u, v)):
        np.minimum.at(lower[:, axis], owner, at)
        np.maximum.at(boxes[:, 2 + axis], owner, at + 1)
    boxes[:, :2] = np.where(boxes[:, 4:] > 0, lower, 0)
    return boxes
