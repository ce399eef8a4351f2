"""Images are embedded once."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from onemap_mapper.query.texts import ImageCache
from onemap_shared.messages import TextEmbeddings
from onemap_shared.transport import RequestRejected


class Embedder:
    """Embeds every image as one vector and records what it was asked."""

    def __init__(self) -> None:
        self.asked: list[bytes] = []

    def __call__(self, image: bytes) -> TextEmbeddings:
        self.asked.append(image)
        if image == b"bad":
            raise RequestRejected("bad_image", "cut off")
        ones, none = np.ones((1, 4), np.float32), np.zeros((0, 4), np.float32)
        return TextEmbeddings("e", "space", ("image",), ones, none, np.zeros((1, 0), np.uint8), 1.0)


def test_an_image_is_embedded_once_until_the_encoder_changes() -> None:
    embedder = Embedder()
    cache = ImageCache(embedder, torch.device("cpu"))
    space, query = cache.query(b"one")
    assert space == "space"
    assert cache.query(b"one")[1] is query
    cache.clear()
    assert cache.query(b"one")[1] is not query
    assert embedder.asked == [b"one", b"one"]


def test_a_refused_image_is_asked_again() -> None:
    embedder = Embedder()
    cache = ImageCache(embedder, torch.device("cpu"))
    for _ in range(2):
        with pytest.raises(RequestRejected, match="cut off"):
            cache.query(b"bad")
    assert len(embedder.asked) == 2
