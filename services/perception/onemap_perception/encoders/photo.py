"""The encoder ``photo``: ``mini`` and a second opinion by a classifier of photographs.

An ImageNet classifier (EfficientNet-Lite0) is applied at every position (class activation: Zhou
et al., "Learning Deep Features for Discriminative Localization", 2016). Its probabilities of
household names weight the names' embeddings (ConSE: Norouzi et al., "Zero-Shot Learning by Convex
Combination of Semantic Embeddings", 2014), whose sum is the shorter the less certain it is. The
classifier knows no walls, floors and ceilings, which ``mini`` tells well: there it has no say.
Nor does it know that it never saw rendered images, of which it is as sure as of photographs.
``mini`` is sure of the former alone: where it is, the classifier is not asked. Nothing is trained.
See photo/MODEL_CARD.md.
"""
# Touches files: weights, names.

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from onemap_perception.config import SHIPPED, PhotoParams
from onemap_perception.encoders.images import mean_feature, resized
from onemap_perception.encoders.mini import TEXT_SPACE, MiniEncoder, crop_of
from onemap_perception.errors import BackendError
from onemap_perception.onnx import open_session
from onemap_perception.text.queries import QueryEncoder
from onemap_perception.text.vocabulary import load_calibration, load_table, load_vocabulary
from onemap_shared.geometry import F16, F32, U8, Bool
from onemap_shared.messages import TextEmbeddings, expect

FOLDER = Path(__file__).parents[1] / "photo"
NETWORK_FILE = "photo.onnx"
NAMES_FILE = "names.json"
SHA256 = "22e71dd59091d4b6efd8943325e009f2fee736d5daeb4391ee7b21d159e02599"
STRIDE = 16  # pixels from one position of the classifier to the next
INPUT_WIDTH_PX = 640  # wider images are reduced to this
WEIGHT = np.float32(2)  # of the second opinion, where it is certain
SAME_WORD = 0.9  # cosine of queries, which lean to the nearest class as the words' targets do
SURFACES = ("wall", "floor", "ceiling")
# Entropy of ``mini``'s classes in nats, the mean of an image's patches, up to which it knows what
# it sees: that of two classes that are equally likely.
MAX_ENTROPY = np.log(2)


class PhotoEncoder:
    """Implements ``ImageEncoder``. Raises BackendError when its files are missing or damaged.

    folder: of the classifier.
    """

    def __init__(self, params: PhotoParams, folder: Path = FOLDER) -> None:
        self._mini = MiniEncoder(params)
        self._text = self._mini.text
        names = load_vocabulary(params.folder).names
        self._classes = self._text.queries(names, encoder_id="", text_space=TEXT_SPACE)
        self._surfaces = np.isin(names, SURFACES)
        self._session = open_classifier(folder)
        self._targets = name_embeddings(household_names(folder), params.folder)
        self._seen: tuple[U8, F32, F32 | None] | None = None  # the newest image and its looks
        self._id = f"photo-{SHA256[:8]}-{self._mini.encoder_id}"

    @property
    def encoder_id(self) -> str:
        """``photo-``, the first digits of the classifier's SHA-256, and the id of ``mini``."""
        return self._id

    @property
    def text_space(self) -> str:
        """That of ``mini``."""
        return TEXT_SPACE

    def encode(self, rgb: U8) -> F16:
        """See ``Encoder``; the patches are those of ``mini``."""
        features, opinion = self.looks(rgb)
        if opinion is None:
            return features.astype(np.float16)
        surface = self._shares(features)[..., self._surfaces].sum(axis=-1, keepdims=True)
        summed = features + WEIGHT * (1 - surface) * opinion
        unit: F16 = (summed / np.linalg.norm(summed, axis=-1, keepdims=True)).astype(np.float16)
        return unit

    def looks(self, rgb: U8) -> tuple[F32, F32 | None]:
        """What each network sees in an image: ``mini``'s features (h, w, D), and the classifier's
        mean embeddings (h, w, D), of length 0 to 1; None where ``mini`` is sure of the image.
        Those of the newest image are kept."""
        expect(rgb, "rgb", np.uint8, (None, None, 3))
        seen = self._seen
        if seen is None or seen[0] is not rgb:
            features = self._mini.encode(rgb).astype(np.float32)
            foreign = mean_entropy(self._shares(features)) > MAX_ENTROPY
            opinion = self._opinion(rgb, *features.shape[:2]) if foreign else None
            self._seen = seen = rgb, features, opinion
        return seen[1:]

    def _shares(self, features: F32) -> F32:
        """Probabilities (h, w, N) of ``mini``'s classes."""
        logits = np.float32(self._classes.temperature) * (features @ self._classes.embeddings.T)
        likely = np.exp(logits - logits.max(axis=-1, keepdims=True))
        shares: F32 = likely / likely.sum(axis=-1, keepdims=True)
        return shares

    def classified(self, texts: F32) -> Bool:
        """Which of the embeddings (N, D) of texts are those of words that the classifier knows."""
        known: Bool = (texts @ self._targets.T).max(axis=1) >= SAME_WORD
        return known

    def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
        """See ``Encoder``."""
        return self._text.queries(texts, encoder_id=self._id, text_space=TEXT_SPACE)

    def embed_image(self, rgb: U8) -> TextEmbeddings:
        """See ``ImageEncoder``; as that of ``mini``."""
        features = self.encode(crop_of(rgb))
        vector = mean_feature(features, np.ones(features.shape[:2], np.float32))
        return self._text.vector_query(vector, encoder_id=self._id, text_space=TEXT_SPACE)

    def _opinion(self, rgb: U8, rows: int, columns: int) -> F32:
        """The classifier's mean embedding (rows, columns, D) of an image, of length 0 to 1."""
        scale = min(1.0, INPUT_WIDTH_PX / rgb.shape[1])
        size = tuple(max(round(side * scale), 1) for side in (rgb.shape[1], rgb.shape[0]))
        image = np.ascontiguousarray(resized(rgb, size))
        try:
            shares: F32 = self._session.run(["shares"], {"rgb": image})[0]
        except Exception as problem:  # onnxruntime's errors share no other base class
            raise BackendError(f"onnxruntime failed on a {size} image: {problem}") from problem
        return at_patches(shares @ self._targets, size, rows, columns)


def mean_entropy(shares: F32) -> float:
    """Mean over the patches of the entropy of probabilities (h, w, N), in nats."""
    surprise = np.log(np.maximum(shares, np.finfo(np.float32).tiny))
    return float(-(shares * surprise).sum(axis=-1).mean())


def at_patches(values: F32, size: tuple[int, int], rows: int, columns: int) -> F32:
    """Values (h, w, C) of the classifier's positions, interpolated at an image's patches.

    size: of the image, (width, height) in pixels. Position i lies at pixel ``STRIDE`` * i, on
    which its convolutions are centred. Returns (rows, columns, C).
    """
    for axis, (count, pixels) in enumerate(((rows, size[1]), (columns, size[0]))):
        place = ((np.arange(count) + 0.5) * pixels / count - 0.5) / STRIDE
        place = np.clip(place, 0, values.shape[axis] - 1)
        before = place.astype(int)
        after = np.minimum(before + 1, values.shape[axis] - 1)
        share = (place - before).astype(np.float32).reshape((-1, 1, 1) if axis == 0 else (-1, 1))
        values = values.take(before, axis) * (1 - share) + values.take(after, axis) * share
    return values


def household_names(folder: Path = FOLDER) -> dict[str, dict[str, int]]:
    """By everyday word: ImageNet's names that mean it, with their numbers, in the order of the
    classifier's outputs. Those under "" are of scenes, such as a library: they compete with the
    others, and have no vote. Raises BackendError."""
    path = folder / NAMES_FILE
    try:
        names: dict[str, dict[str, int]] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as problem:
        raise BackendError(f"cannot read {path}: {problem}; reinstall OneMap") from problem
    return names


def name_embeddings(names: Mapping[str, Mapping[str, int]], mini: Path) -> F32:
    """Of each output of the classifier, as queries for its everyday word are embedded: (N, D).

    Zeros for names without a word. mini: the folder whose classes the words may name.
    """
    text = QueryEncoder(
        load_vocabulary(mini), load_table(SHIPPED), load_calibration(mini), raw=True
    )
    words = tuple(word for word in names if word)
    rows = text.queries(words, encoder_id="", text_space=TEXT_SPACE).embeddings
    by_word = {"": np.zeros_like(rows[0]), **dict(zip(words, rows, strict=True))}
    return np.stack([by_word[word] for word, meaning in names.items() for _ in meaning])


def open_classifier(folder: Path) -> Any:
    """Its session; BackendError unless the weights are those that are pinned here."""
    path = folder / NETWORK_FILE
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as problem:
        raise BackendError(f"the classifier {path} is missing: reinstall OneMap") from problem
    if digest != SHA256:
        raise BackendError(
            f"the classifier {path} is damaged: its SHA-256 is {digest[:12]}..., not "
            f"{SHA256[:12]}...; reinstall OneMap"
        )
    return open_session(path, threads=1)  # the other cores run other services
