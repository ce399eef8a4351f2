from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from onemap_perception.config import SHIPPED, MiniParams
from onemap_perception.encoders.mini import MiniEncoder
from onemap_perception.encoders.projected import ProjectedEncoder, embed_words
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.geometry import F16, F32, U8
from onemap_shared.messages import TextEmbeddings

DIMENSION, SPAN = 24, 6
RNG = np.random.default_rng(3)
PLANE = np.linalg.qr(RNG.standard_normal((DIMENSION, SPAN)))[0].T  # where all texts lie


def unit(rows: np.ndarray) -> F32:
    made: F32 = (rows / np.linalg.norm(rows, axis=-1, keepdims=True)).astype(np.float32)
    return made


class PlanarEncoder:
    """Texts lie in a subspace, features anywhere."""

    encoder_id, text_space = "planar", "plane"

    def encode(self, rgb: U8) -> F16:
        rng = np.random.default_rng(rgb.shape[0])
        return unit(rng.standard_normal((4, 5, DIMENSION))).astype(np.float16)

    def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
        rows = [np.random.default_rng(len(t) + ord(t[0])).standard_normal(SPAN) for t in texts]
        embeddings = unit(np.stack(rows) @ PLANE)
        neutral = unit(np.ones((1, SPAN)) @ PLANE)
        mask = np.ones((len(texts), 1), np.uint8)
        return TextEmbeddings("planar", "plane", tuple(texts), embeddings, neutral, mask, 20.0, 0.3)

    def embed_image(self, rgb: U8) -> TextEmbeddings:
        return self.embed_text(["image"])


WORDS = [letter * count for letter in "abcdefgh" for count in (1, 2, 3, 5)]
IMAGE = np.zeros((8, 8, 3), np.uint8)


def cosines(encoder: Encoder, texts: Sequence[str]) -> F32:
    """Of every patch of the image with every text."""
    features = encoder.encode(IMAGE).reshape(20, -1).astype(np.float32)
    made: F32 = features @ encoder.embed_text(texts).embeddings.T
    return made


def test_cosines_with_texts_of_the_span_stay() -> None:
    full = PlanarEncoder()
    projected = ProjectedEncoder(full, embed_words(full, WORDS), SPAN + 1)
    features = projected.encode(IMAGE)
    assert features.shape == (4, 5, SPAN + 1)
    assert features.dtype == np.float16
    np.testing.assert_allclose(np.linalg.norm(features.astype(float), axis=-1), 1, atol=2e-3)
    np.testing.assert_allclose(
        cosines(projected, ["x", "yy"]), cosines(full, ["x", "yy"]), atol=2e-3
    )
    assert np.ptp(cosines(full, ["x"])) > 0.2  # they do differ


@pytest.mark.parametrize("channels", [1, DIMENSION + 1])
def test_impossible_numbers_of_channels_are_refused(channels: int) -> None:
    full = PlanarEncoder()
    with pytest.raises(BackendError, match=f"channels is {channels}; this encoder has 24"):
        ProjectedEncoder(full, embed_words(full, WORDS), channels)


def test_mini_keeps_the_order_of_patches_in_a_third_of_its_channels() -> None:
    image = np.random.default_rng(5).integers(0, 255, (12, 16, 3), dtype=np.uint8)
    image = image.repeat(20, axis=0).repeat(20, axis=1)
    full, projected = MiniEncoder(MiniParams()), make_encoder(MiniParams(channels=128))
    words = load_vocabulary(SHIPPED).names[:10]

    def ranks(encoder: Encoder) -> np.ndarray:
        features = encoder.encode(image)
        flat = features.reshape(-1, features.shape[-1]).astype(np.float32)
        cosine: np.ndarray = flat @ encoder.embed_text(words).embeddings.T
        return cosine.argsort(axis=0).argsort(axis=0)

    assert projected.encode(image).shape[-1] == 128
    before, after = ranks(full), ranks(projected)
    for word in range(len(words)):
        assert np.corrcoef(before[:, word], after[:, word])[0, 1] > 0.99
