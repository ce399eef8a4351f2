"""An encoder with fewer channels: features and texts in the part of the space that words span.

The basis is the first right singular vectors of the embeddings of everyday words, found at start.
What a feature has outside of it goes into one more channel, as a length, so that features stay
unit vectors and their cosines with texts keep their size; texts have 0 there. A cosine changes by
what the text itself loses, which is little for the names of things.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from onemap_perception.encoders.protocol import Encoder, ImageEncoder
from onemap_perception.errors import BackendError
from onemap_shared.geometry import F16, F32, U8
from onemap_shared.messages import TextEmbeddings

TEXTS_AT_ONCE = 128
DIGITS = 2  # of the basis, in the name of the space: other processors round the last ones otherwise


class ProjectedEncoder:
    """Implements ``ImageEncoder`` over another one. Raises BackendError if it has no more channels.

    words (N, D) float32: their embeddings. basis (D, K) float32 orthonormal columns.
    """

    def __init__(self, encoder: ImageEncoder, words: F32, channels: int) -> None:
        self._encoder = encoder
        self.basis = _basis(words, channels)
        digest = hashlib.sha256(np.round(self.basis, DIGITS).astype("<f4").tobytes()).hexdigest()
        self._name = f"{channels}c-{digest[:8]}"

    @property
    def encoder_id(self) -> str:
        """The encoder's own, with the channels and a hash of the basis."""
        return f"{self._encoder.encoder_id}-{self._name}"

    @property
    def text_space(self) -> str:
        """The encoder's own, with the channels and a hash of the basis."""
        return f"{self._encoder.text_space}-{self._name}"

    def encode(self, rgb: U8) -> F16:
        """See ``Encoder``: (h, w, K + 1), the last channel what lies outside of the basis."""
        features = self._encoder.encode(rgb).astype(np.float32)
        inside = features @ self.basis
        outside = np.sqrt(np.maximum(1.0 - np.square(inside).sum(-1, keepdims=True), 0.0))
        projected = np.concatenate([inside, outside], axis=-1)
        unit: F16 = (projected / np.linalg.norm(projected, axis=-1, keepdims=True)).astype(
            np.float16
        )
        return unit

    def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
        """See ``Encoder``."""
        return self._within(self._encoder.embed_text(texts))

    def embed_image(self, rgb: U8) -> TextEmbeddings:
        """See ``Encoder``; of the crop's feature, what lies in the basis."""
        return self._within(self._encoder.embed_image(rgb))

    def _within(self, full: TextEmbeddings) -> TextEmbeddings:
        """The other encoder's embeddings in the projected space."""
        return replace(
            full,
            encoder_id=self.encoder_id,
            text_space=self.text_space,
            embeddings=self._projected(full.embeddings),
            neutral=self._projected(full.neutral),
        )

    def _projected(self, texts: F32) -> F32:
        """Unit rows (N, K + 1) of texts (N, D)."""
        inside = texts @ self.basis
        length = np.linalg.norm(inside, axis=1, keepdims=True)
        unit = inside / np.where(length > 0, length, 1.0)
        return np.pad(unit, ((0, 0), (0, 1))).astype(np.float32)


def embed_words(encoder: Encoder, words: Sequence[str]) -> F32:
    """Embeddings (N, D) of the words; raises UnknownWordError."""
    parts = [words[at : at + TEXTS_AT_ONCE] for at in range(0, len(words), TEXTS_AT_ONCE)]
    return np.concatenate([encoder.embed_text(part).embeddings for part in parts])


def _basis(texts: F32, channels: int) -> F32:
    """The ``channels`` - 1 directions (D, K) that hold most of the texts (N, D)."""
    count, dimension = texts.shape
    if not 2 <= channels <= min(count, dimension):
        raise BackendError(
            f"perception.encoder.channels is {channels}; this encoder has {dimension} and is "
            f"fitted on {count} words: choose 2 to {min(count, dimension)}, or 0 for all"
        )
    _, _, directions = np.linalg.svd(texts.astype(np.float64), full_matrices=False)
    basis = directions[: channels - 1].T
    peaks = np.take_along_axis(basis, np.abs(basis).argmax(axis=0)[None], axis=0)
    fixed: F32 = (basis * np.sign(peaks)).astype(np.float32)  # its sign is the library's choice
    return fixed
