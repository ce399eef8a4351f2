"""All textures of a scene with their mipmaps in one flat array of texels.

One gather fetches the texels of all pixels, whatever their textures. Far surfaces
read a coarser level, which avoids aliasing of fine patterns; small textures are
enlarged by interpolation, so that near surfaces show no blocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from onemap_shared.geometry import F32, I32, U8

MAX_LEVELS = 10  # halved nine times, a 512 px texture is one texel
ENLARGED_PX = 256  # smaller textures are enlarged to about this: 4 mm texels on a metre of wall
PALETTE_PX = 32  # below this a texture is a palette, whose colours must not blend


@dataclass(frozen=True, slots=True)
class TextureAtlas:
    """Texels (T, 3) uint8 RGB, with the first texel and the size of each mipmap level.

    offsets, widths, heights (textures, MAX_LEVELS) int32; level k is halved k times and
    the smallest one fills the remaining levels.
    """

    texels: U8
    offsets: I32
    widths: I32
    heights: I32

    @classmethod
    def of(cls, textures: Sequence[U8]) -> TextureAtlas:
        """Pack textures (h, w, 3) uint8 with all their mipmap levels."""
        texels: list[U8] = []
        tables = np.zeros((3, len(textures), MAX_LEVELS), np.int32)
        used = 0
        for index, texture in enumerate(textures):
            start = used
            copy = _enlarged(texture)
            for level in range(MAX_LEVELS):
                height, width = copy.shape[:2]
                if level == 0 or tables[1:, index, level - 1].tolist() != [width, height]:
                    texels.append(copy.reshape(-1, 3))
                    start, used = used, used + width * height
                tables[:, index, level] = (start, width, height)
                half = (max(width // 2, 1), max(height // 2, 1))
                smaller = cv2.resize(copy, half, interpolation=cv2.INTER_AREA)
                copy = np.asarray(smaller, np.uint8).reshape(half[1], half[0], 3)
        return cls(np.concatenate(texels), tables[0], tables[1], tables[2])

    def sample(self, texture: I32, level: I32, u: F32, v: F32) -> U8:
        """Nearest texels (N, 3) uint8 at texture coordinates (N,), repeating outside [0, 1)."""
        entry = texture * MAX_LEVELS + np.clip(level, 0, MAX_LEVELS - 1)
        width = self.widths.ravel()[entry]
        height = self.heights.ravel()[entry]
        # The fraction of a tiny negative number rounds up to 1, hence the minimum.
        column = np.minimum(((u - np.floor(u)) * width).astype(np.int32), width - 1)
        row = np.minimum(((v - np.floor(v)) * height).astype(np.int32), height - 1)
        at = self.offsets.ravel()[entry] + row * width + column
        texels: U8 = self.texels.take(at.astype(np.int32), axis=0)
        return texels


def _enlarged(texture: U8) -> U8:
    """The texture (h, w, 3) enlarged by a whole factor to nearly ENLARGED_PX on its smaller side.

    Interpolates across the edges, because textures repeat.
    """
    height, width = texture.shape[:2]
    factor = ENLARGED_PX // min(height, width)
    if factor <= 1 or min(height, width) < PALETTE_PX or (texture == texture[0, 0]).all():
        return np.ascontiguousarray(texture)
    padded = np.pad(texture, ((1, 1), (1, 1), (0, 0)), mode="wrap")
    size = ((width + 2) * factor, (height + 2) * factor)
    large = cv2.resize(padded, size, interpolation=cv2.INTER_LINEAR)
    inner: U8 = np.ascontiguousarray(large[factor:-factor, factor:-factor], np.uint8)
    return inner
