"""A toy encoder: the patch's colour is its feature, colours have names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from onemap_perception.encoders.images import mean_feature
from onemap_perception.errors import BackendError, UnknownWordError
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F16, U8
from onemap_shared.messages import RgbdFrame, TextEmbeddings

PATCH_PX = 8
COLOURS = ("red", "green", "blue")
CAMERA = Intrinsics(40.0, 40.0, 24.0, 16.0)


class ColourEncoder:
    """Implements ``ImageEncoder``: red, green and blue are the three axes of its space."""

    encoder_id = "toy"
    text_space = "colours"

    def encode(self, rgb: U8) -> F16:
        if rgb[0, 0].tolist() == [1, 2, 3]:
            raise BackendError("this image breaks the toy")
        rows, columns = (max(side // PATCH_PX, 1) for side in rgb.shape[:2])
        corner = rgb[::PATCH_PX, ::PATCH_PX][:rows, :columns].astype(np.float32) + 1e-3
        unit: F16 = (corner / np.linalg.norm(corner, axis=-1, keepdims=True)).astype(np.float16)
        return unit

    def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
        unknown = [text for text in texts if text not in COLOURS]
        if unknown:
            named = " and ".join(map(repr, unknown))
            raise UnknownWordError(f"{named} is no colour", dict.fromkeys(unknown, ("blue",)))
        axes = np.eye(3, dtype=np.float32)
        chosen = [COLOURS.index(text) for text in texts]
        return TextEmbeddings(
            encoder_id=self.encoder_id,
            text_space=self.text_space,
            texts=tuple(texts),
            embeddings=axes[chosen],
            neutral=axes,
            neutral_mask=(1 - axes[chosen]).astype(np.uint8),
            temperature=10.0,
        )

    def embed_image(self, rgb: U8) -> TextEmbeddings:
        features = self.encode(rgb)
        colour = mean_feature(features, np.ones(features.shape[:2], np.float32))
        return replace(self.embed_text(("red",)), texts=("image",), embeddings=colour[None])


def frame(sequence: int = 1, *, rgb: U8 | None = None, depth_mm: int = 2000) -> RgbdFrame:
    """A green image of 48 x 32 with a red square, at one depth."""
    if rgb is None:
        rgb = np.zeros((32, 48, 3), np.uint8)
        rgb[..., 1] = 200
        rgb[8:24, 16:32] = (200, 0, 0)
    return RgbdFrame(
        sequence=sequence,
        stamp_ns=1_000_000_000 + sequence,
        rgb=rgb,
        depth_mm=np.full(rgb.shape[:2], depth_mm, np.uint16),
        intrinsics=CAMERA,
        T_map_camera=np.eye(4),
    )
