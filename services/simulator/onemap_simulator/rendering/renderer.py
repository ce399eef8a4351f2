"""RGB, metric depth and object labels of a scene, on the CPU by Embree.

All rays of an image are traced in one call and shaded with whole-array
arithmetic.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, I32, U8
from onemap_simulator.physics.people import NOBODY, Bystanders
from onemap_simulator.rendering.lighting import LightMap
from onemap_simulator.rendering.ray_tracer import RayHits, RayTracer
from onemap_simulator.rendering.rendered_image import (
    CLOTHES_RGB,
    PersonLook,
    RenderedImage,
    ViewRays,
    person_label,
    with_bystanders,
)
from onemap_simulator.scene.scene import Scene

SKY_RGB = (196, 212, 228)  # where a ray leaves the scene
MAX_LEVELS = 10  # halved nine times, a 512 px texture is one texel
ENLARGED_PX = 256  # smaller textures are enlarged to about this: 4 mm texels on a metre of wall
PALETTE_PX = 32  # below this a texture is a palette, whose colours must not blend


@dataclass(frozen=True, slots=True)
class TextureAtlas:
    """All textures of a scene with their mipmaps in one flat array, read by one gather.

    Far surfaces read a coarser level, which avoids aliasing of fine patterns; small textures are
    enlarged, so that near surfaces show no blocks. Texels (T, 3) uint8 RGB, with the first texel
    and the size of each mipmap level.

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


@dataclass(frozen=True, slots=True)
class _FaceTable:
    """Per-face values for shading, with one more row for rays that hit nothing (face -1).

    corner_uv (F + 1, 3, 2) float32: the first corner's texture coordinates and the edges from
    it; normals (F + 1, 3) float32 unit; texels_per_m_log2 (F + 1,) float32; objects and
    textures (F + 1,) int32.
    """

    corner_uv: F32
    normals: F32
    texels_per_m_log2: F32
    objects: I32
    textures: I32

    @classmethod
    def of(cls, scene: Scene, atlas: TextureAtlas) -> _FaceTable:
        """Tabulate the scene's faces; a miss shows the last texture of the atlas."""
        corners = scene.vertices[scene.faces].astype(np.float64)
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        doubled_area = np.linalg.norm(cross, axis=1)
        normals = cross / np.maximum(doubled_area, 1e-12)[:, None]
        uv = scene.face_uv.astype(np.float64)
        edges = uv[:, 1:] - uv[:, :1]
        uv_area = np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
        texels = atlas.widths[:, 0].astype(np.float64) * atlas.heights[:, 0]
        density = uv_area * texels[scene.face_texture] / np.maximum(doubled_area, 1e-12)
        return cls(
            corner_uv=_with_miss(np.concatenate([uv[:, :1], edges], axis=1), 0, np.float32),
            normals=_with_miss(normals, 0, np.float32),
            texels_per_m_log2=_with_miss(0.5 * np.log2(np.maximum(density, 1e-12)), 0, np.float32),
            objects=_with_miss(scene.face_object, -1, np.int32),
            textures=_with_miss(scene.face_texture, len(scene.textures), np.int32),
        )


def _with_miss(rows: np.ndarray, miss: float, dtype: type) -> np.ndarray:
    """The rows with one more at the end, where index -1 finds it."""
    return np.concatenate([rows, np.full((1, *rows.shape[1:]), miss)]).astype(dtype)


class Renderer:
    """Renders one scene from any pose; safe to use from one thread at a time."""

    def __init__(self, scene: Scene) -> None:
        self._tracer = RayTracer(scene)
        sky = np.full((1, 1, 3), SKY_RGB, np.uint8)
        self._atlas = TextureAtlas.of((*scene.textures, sky))
        self._faces = _FaceTable.of(scene, self._atlas)
        self._light = LightMap.of(scene, self._tracer.occluded)
        self._person = PersonLook(person_label(scene), CLOTHES_RGB, flat=False)

    def render(
        self,
        T_map_camera: F64,
        intrinsics: Intrinsics,
        *,
        width: int,
        height: int,
        people: Bystanders = NOBODY,
    ) -> RenderedImage:
        """The image at T_map_camera (4, 4)."""
        rays, shape = ViewRays.of(T_map_camera, intrinsics, width, height), (height, width)
        hits = self._tracer.hits_of(rays.origin, rays.directions)
        face, depth, directions = hits.face, hits.distance, rays.directions
        albedo = self._albedo(hits, intrinsics.focal_px).reshape(*shape, 3)
        normals = np.take(self._faces.normals, face, axis=0)
        # Triangles are two-sided: flip normals that face away from the camera.
        away = np.einsum("ij,ij->i", normals, directions) > 0
        normals *= np.where(away, np.float32(-1), np.float32(1))[:, None]
        points = rays.origin + directions * depth[:, None]
        planes = (np.ascontiguousarray(rows.T).reshape(3, *shape) for rows in (points, normals))
        light = self._light.irradiance(*planes)
        light[:, (face < 0).reshape(shape)] = 1.0
        rgb = np.empty((*shape, 3), np.uint8)
        for channel in range(3):
            rgb[..., channel] = np.minimum(albedo[..., channel] * light[channel], 255)
        labels = self._faces.objects[face].reshape(shape)
        image = RenderedImage(rgb, depth.reshape(shape), labels, face.reshape(shape))
        return with_bystanders(image, rays, people, self._person)

    def _albedo(self, hits: RayHits, focal_px: float) -> U8:
        """Texture colours (N, 3) uint8 of the surfaces hit."""
        face = hits.face
        uv = np.take(self._faces.corner_uv, face, axis=0)
        at = uv[:, 0] + uv[:, 1] * hits.u[:, None] + uv[:, 2] * hits.v[:, None]
        # The mipmap level whose texel is about as large as the pixel's footprint.
        texels_per_pixel_log2 = self._faces.texels_per_m_log2[face] + np.log2(
            np.maximum(hits.distance, 1e-3) / focal_px
        )
        level = np.rint(texels_per_pixel_log2).astype(np.int32)
        return self._atlas.sample(self._faces.textures[face], level, at[:, 0], at[:, 1])
