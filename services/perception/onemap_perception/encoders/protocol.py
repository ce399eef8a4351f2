"""The interface of encoders."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from onemap_shared.geometry import F16, U8
from onemap_shared.messages import TextEmbeddings


class Encoder(Protocol):
    """Embeds images and texts in one space; dimension and patch size are the encoder's own."""

    @property
    def encoder_id(self) -> str:
        """Names weights and text side; fields of different encoders are never mixed."""

    @property
    def text_space(self) -> str:
        """Names the space of the embeddings."""

    def encode(self, rgb: U8) -> F16:
        """Unit features (h, w, D) float16 of an image (H, W, 3) uint8 of any size."""

    def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
        """Embeddings and calibration of the texts; raises UnknownWordError."""


class ImageEncoder(Encoder, Protocol):
    """An encoder that also takes a picture of one thing for a query."""

    def embed_image(self, rgb: U8) -> TextEmbeddings:
        """The embedding of what a crop (H, W, 3) uint8 shows, in the place of a text's.

        It is made of the features that ``encode`` gives its patches, so that it is consistent with
        the map. ``floor`` is 0: it is not measured for images.
        """
