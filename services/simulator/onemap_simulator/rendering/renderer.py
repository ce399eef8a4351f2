"""RGB, metric depth and object labels of a scene, on the CPU by Embree.

All rays of an image are traced in one call and shaded with whole-array
arithmetic.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from onemap_shared.camera import Intrinsics, ray_directions
from onemap_shared.geometry import F32, F64, I32, U8, check_rigid
from onemap_simulator.physics.people import NOBODY, Bystanders
from onemap_simulator.rendering.bystanders import (
    CLOTHES_RGB,
    PersonLook,
    ViewRays,
    person_label,
    with_bystanders,
)
from onemap_simulator.rendering.lighting import LightMap
from onemap_simulator.rendering.ray_tracer import RayHits, RayTracer
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.rendering.texture_atlas import TextureAtlas
from onemap_simulator.scene.scene import Scene

SKY_RGB = (196, 212, 228)  # where a ray leaves the scene


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
        """Render at T_map_camera (4, 4); pixel centres at half-integer coordinates."""
        T = check_rigid(T_map_camera, "T_map_camera").astype(np.float32)
        # With directions of camera z = 1, the distance along the ray is the depth.
        directions = _flat_rays(intrinsics, width, height) @ T[:3, :3].T
        origins = np.broadcast_to(T[:3, 3], directions.shape)
        hits = self._tracer.first_hits(origins, directions)
        face, depth = hits.face, hits.distance
        albedo = self._albedo(hits, intrinsics.focal_px).reshape(height, width, 3)
        normals = np.take(self._faces.normals, face, axis=0)
        # Triangles are two-sided: flip normals that face away from the camera.
        away = np.einsum("ij,ij->i", normals, directions) > 0
        normals *= np.where(away, np.float32(-1), np.float32(1))[:, None]
        points = origins + directions * depth[:, None]
        light = self._light.irradiance(
            _planes(points, height, width), _planes(normals, height, width)
        )
        light[:, (face < 0).reshape(height, width)] = 1.0
        rgb = np.empty((height, width, 3), np.uint8)
        for channel in range(3):
            rgb[..., channel] = np.minimum(albedo[..., channel] * light[channel], 255)
        image = RenderedImage(
            rgb,
            depth.reshape(height, width),
            self._faces.objects[face].reshape(height, width),
            face.reshape(height, width),
        )
        return with_bystanders(image, ViewRays(T[:3, 3], directions), people, self._person)

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


def _planes(rows: F32, height: int, width: int) -> F32:
    """Vectors (H * W, 3) as three contiguous images (3, H, W)."""
    planes: F32 = np.ascontiguousarray(rows.T).reshape(3, height, width)
    return planes


@lru_cache(maxsize=8)
def _flat_rays(intrinsics: Intrinsics, width: int, height: int) -> F32:
    """``ray_directions`` of all pixels as (H * W, 3), row by row; cached, therefore read-only."""
    rays = ray_directions(intrinsics, width, height).reshape(-1, 3)
    rays.flags.writeable = False
    return rays
