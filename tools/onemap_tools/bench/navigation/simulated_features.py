"""A simulated encoder: features from the object labels that the simulator renders.

The image holds labels in place of colours (``label_renderer``). A patch's feature is the mean of
its objects' text embeddings, blurred, with errors of set size; ``uncalibrated`` adds a component
that all images have in common and another that all texts have, as the encoders of the CLIP family.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from pydantic import Field

from onemap_perception.text.calibration import load_calibration
from onemap_perception.text.embedding_table import EmbeddingTable, load_table
from onemap_perception.text.queries import QueryEncoder
from onemap_perception.text.scores import uncalibrated_queries
from onemap_perception.text.text_encoder import unit_rows
from onemap_perception.text.vocabulary import Vocabulary, load_vocabulary
from onemap_shared.geometry import F16, F32, I32, U8
from onemap_shared.messages import TextEmbeddings
from onemap_shared.params import Params
from onemap_simulator.rendering.label_renderer import labels_of
from onemap_simulator.scene.scene import STRUCTURE, Scene

CONFUSABLE = 5  # an object is confused with one of this many categories most like its own


class SimulatedFeatureParams(Params):
    """How the features differ from the text embeddings of what the camera sees."""

    patch_px: int = Field(
        default=4, ge=1, description="Pixels per patch side: 40 x 30 patches, as many as mini's."
    )
    dimension: int = Field(
        default=64,
        ge=8,
        le=384,
        description="Numbers per feature: the first principal components of mini's 384. The "
        "cosines between its classes change by 0.03 on average, 0.10 at most; the map is fused "
        "and queried in a fifth of the time.",
    )
    noise: float = Field(
        default=1.0,
        ge=0,
        description="Length of the random vector added to each patch's unit feature, new in each "
        "frame: fusion averages it out.",
    )
    object_noise: float = Field(
        default=0.5,
        ge=0,
        description="Length of the random vector added to each object's unit feature, the same in "
        "all frames: fusion does not help.",
    )
    confusion: float = Field(
        default=0.06,
        ge=0,
        le=1,
        description="Share of the objects that look like another, similar category: as many as "
        "the pixels that mini gets wrong.",
    )
    blur_patches: float = Field(
        default=0.7,
        ge=0,
        description="Standard deviation of the blur in patches: features mix at the borders of "
        "objects.",
    )
    common: float = Field(
        default=0.0,
        ge=0,
        description="Length of the component that all features share, and of that of all texts; "
        "0: scores are calibrated against neutral words, as with mini.",
    )
    common_cosine: float = Field(
        default=0.2,
        ge=-1,
        le=1,
        description="Cosine between these two components: the gap between images and texts.",
    )


# Of CLIP's kind: any text has a cosine near 0.25 with any patch, the right one 0.1 more.
UNCALIBRATED = SimulatedFeatureParams(common=1.2)


class SimulatedEncoder:
    """Implements ``Encoder`` for images of labels of one scene. Errors follow from ``rng``."""

    def __init__(
        self, scene: Scene, folder: Path, params: SimulatedFeatureParams, rng: np.random.Generator
    ) -> None:
        self._params, self._rng = params, rng
        vocabulary = load_vocabulary(folder)
        self._table = compact_table(load_table(folder), vocabulary, params.dimension)
        self._queries = QueryEncoder(vocabulary, self._table, load_calibration(folder))
        self._image_mean, self._text_mean = common_components(params, rng)
        self._objects = object_features(scene, self._class_rows(scene), params, rng)

    @property
    def encoder_id(self) -> str:
        """Names the stand-in and whether it is calibrated."""
        return f"simulated-{'uncalibrated' if self._params.common else 'calibrated'}"

    @property
    def text_space(self) -> str:
        """Of the projected embeddings."""
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
        """See ``Encoder``: with mini's neutral words, or without any if ``common`` is not 0."""
        ids = {"encoder_id": self.encoder_id, "text_space": self.text_space}
        queries = self._queries.queries(texts, **ids)
        if not self._params.common:
            return queries
        rows = _unit(queries.embeddings + np.float32(self._params.common) * self._text_mean)
        return uncalibrated_queries(texts, rows, **ids, floor=0.0)

    def _class_rows(self, scene: Scene) -> F32:
        """Embeddings (objects, D) of the objects' categories."""
        categories = [thing.category for thing in scene.objects]
        return self._queries.queries(categories, encoder_id="", text_space="").embeddings


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
    seen = labels >= 0
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
