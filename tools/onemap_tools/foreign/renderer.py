"""Renders a lit scene in a style of its own: soft light, highlights, mirrors, a film's curve.

The simulator's renderer shades without highlights and in the colours of the screen; this one
computes in linear light, and its images pass through a camera: exposure, white balance, vignette,
noise, JPEG.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from onemap_shared.camera import Intrinsics, ray_directions
from onemap_shared.geometry import F32, F64, I32, U8, Bool
from onemap_simulator.rendering.ray_tracer import RayHits, RayTracer
from onemap_simulator.rendering.texture_atlas import TextureAtlas
from onemap_tools.foreign.lighting import (
    SurfacePoints,
    averaged,
    direct,
    falloff,
    strongest,
    surroundings,
)
from onemap_tools.foreign.lit_scene import AreaLight, LitScene

OVERSAMPLING = 1.5  # rays per pixel along each side, so that edges are smooth
GAMMA = 2.2
SKY = (0.75, 0.85, 1.0)  # linear, where a ray leaves the apartment
MIN_REFLECTION = 0.025  # weaker reflections are not traced
GLOW_STRENGTH = 1.15
EXPOSURE = (0.5, 2.6)  # limits of the automatic exposure
MIDDLE_GREY = 0.33  # linear light that the exposure aims at
NOISE = 0.012
JPEG_QUALITY = 88


@dataclass(frozen=True, slots=True)
class CameraLook:
    """White balance (linear RGB factors) and how much darker the corners are."""

    balance: tuple[float, float, float] = (1.0, 1.0, 1.0)
    vignette: float = 0.2


@dataclass(frozen=True, slots=True)
class _Hit:
    """What N rays hit.

    directions (N, 3) unit; albedo (N, 3) linear; finish (N,) index; missed (N,) bool.
    """

    surface: SurfacePoints
    directions: F32
    albedo: F32
    finish: I32
    missed: Bool


class ForeignRenderer:
    """Renders one scene from any pose; one thread at a time."""

    def __init__(self, lit: LitScene, look: CameraLook | None = None) -> None:
        self._look = look or CameraLook()
        self._lit = lit
        scene = lit.scene
        self._tracer = RayTracer(scene)
        sky = np.full((1, 1, 3), [int(255 * c ** (1 / GAMMA)) for c in SKY], np.uint8)
        self._atlas = TextureAtlas.of((*scene.textures, sky))
        miss = len(scene.textures)
        self._texture = np.append(scene.face_texture, miss).astype(np.int32)
        self._objects = np.append(scene.face_object, -1).astype(np.int32)
        self._uv = np.concatenate([scene.face_uv, np.zeros((1, 3, 2), np.float32)])
        self._normals = np.concatenate([lit.corner_normals, np.zeros((1, 3, 3), np.float32)])
        self._texels_log2 = np.append(_texel_density(lit), 0.0).astype(np.float32)
        table = [(f.gloss, f.sharpness, f.mirror, f.glow, f.metal) for f in lit.finishes]
        self._finish = np.array([*table, (0, 1, 0, 1, 0)], np.float32)
        means = [_linear(t.reshape(-1, 3)[::7]).mean(axis=0) for t in scene.textures]
        self._face_colours = np.array([*means, SKY], np.float32)[self._texture]

    def labels(self, T_map_camera: F64, camera: Intrinsics, width: int, height: int) -> I32:
        """Index (H, W) of the object at every pixel's middle, -1 where there is none."""
        origin, directions = _rays(T_map_camera, camera, width, height)
        hits = self._tracer.first_hits(np.broadcast_to(origin, directions.shape), directions)
        labels: I32 = self._objects[hits.face].reshape(height, width)
        return labels

    def render(
        self,
        T_map_camera: F64,
        camera: Intrinsics,
        *,
        width: int,
        height: int,
        rng: np.random.Generator,
    ) -> U8:
        """The image (H, W, 3) uint8 RGB at T_map_camera (4, 4); rng: of the light and the noise."""
        wide, high = round(OVERSAMPLING * width), round(OVERSAMPLING * height)
        large = camera.scaled(wide / width, high / height)
        origin, directions = _rays(T_map_camera, large, wide, high)
        hit = self._shade(origin, directions, large.focal_px, (high, wide))
        light, shine = self._light(hit, rng)
        glow = self._finish[hit.finish, 3][:, None] * np.float32(GLOW_STRENGTH)
        colour = hit.albedo * (light * (1 - np.minimum(glow, 1)) + glow) + shine
        colour[hit.missed] = SKY
        self._add_reflections(colour, hit, rng)
        image = cv2.resize(
            colour.reshape(high, wide, 3), (width, height), interpolation=cv2.INTER_AREA
        )
        return developed(np.asarray(image, np.float32), self._look, rng)

    def _shade(
        self, origins: F32, directions: F32, focal_px: float, shape: tuple[int, int]
    ) -> _Hit:
        """First hits of rays from origins (3,) or (N, 3) along directions (N, 3)."""
        origins = np.broadcast_to(origins, directions.shape)
        hits = self._tracer.first_hits(origins, directions)
        weights = np.stack([1 - hits.u - hits.v, hits.u, hits.v], axis=1)
        normals = np.einsum("ij,ijk->ik", weights, self._normals[hits.face])
        normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-6)[:, None]
        unit = directions / np.linalg.norm(directions, axis=1)[:, None]
        away = np.einsum("ij,ij->i", normals, unit) > 0
        normals = np.where(away[:, None], -normals, normals).astype(np.float32)
        points = (origins + directions * hits.distance[:, None]).astype(np.float32)
        surface = SurfacePoints(points, normals, *shape)
        albedo = self._albedo(hits, weights.astype(np.float32), focal_px)
        return _Hit(surface, unit, albedo, self._texture[hits.face], hits.face < 0)

    def _albedo(self, hits: RayHits, weights: F32, focal_px: float) -> F32:
        uv = np.einsum("ij,ijk->ik", weights, self._uv[hits.face]).astype(np.float32)
        size = np.log2(np.maximum(hits.distance, 1e-3) / focal_px) + self._texels_log2[hits.face]
        level = np.rint(size).astype(np.int32)
        return _linear(self._atlas.sample(self._texture[hits.face], level, uv[:, 0], uv[:, 1]))

    def _light(self, hit: _Hit, rng: np.random.Generator) -> tuple[F32, F32]:
        """Diffuse light and highlights (N, 3); rays start at every second row and column."""
        full = hit.surface
        coarse = full.halved()
        ambient = np.array(self._lit.ambient, np.float32)
        lights = strongest(self._lit.lights, coarse, self._tracer)
        shares = [direct(light, coarse, self._tracer, rng)[:, None] for light in lights]
        around = surroundings(
            coarse, self._tracer, rng, ambient=ambient, face_colours=self._face_colours
        )
        smooth = averaged(np.concatenate([around, *shares], axis=1), coarse)
        stack = smooth.reshape(coarse.height, coarse.width, -1)
        fine = np.stack(
            [
                cv2.resize(np.ascontiguousarray(stack[..., k]), (full.width, full.height))
                for k in range(stack.shape[-1])
            ],
            axis=-1,
        ).reshape(len(full.points), -1)
        total = fine[:, :3].copy()
        shine = np.zeros_like(total)
        for index, light in enumerate(lights):
            share = fine[:, 3 + index : 4 + index]
            colour = np.array(light.colour, np.float32)
            total += share * colour
            shine += self._highlight(hit, light) * np.sqrt(share) * colour
        return total, shine

    def _highlight(self, hit: _Hit, light: AreaLight) -> F32:
        """Strength (N, 3) of a light's highlight (Blinn's half vector)."""
        to_light = np.array(light.position_m, np.float32) - hit.surface.points
        to_light /= np.maximum(np.linalg.norm(to_light, axis=1), 1e-6)[:, None]
        half = to_light - hit.directions
        half /= np.maximum(np.linalg.norm(half, axis=1), 1e-6)[:, None]
        gloss, sharpness, _, _, metal = self._finish[hit.finish].T
        cosine = np.clip(np.einsum("ij,ij->i", half, hit.surface.normals), 0, 1)
        strength = (gloss * cosine**sharpness)[:, None]
        tint = np.where(metal[:, None] > 0, hit.albedo * 1.5, 1.0)
        shine: F32 = (strength * tint).astype(np.float32)
        return shine

    def _add_reflections(self, colour: F32, hit: _Hit, rng: np.random.Generator) -> None:
        """Mix what mirrors, steel, lacquer and glass reflect into colours (N, 3), in place."""
        gloss, sharpness, mirror, _, metal = self._finish[hit.finish].T
        facing = np.clip(-np.einsum("ij,ij->i", hit.directions, hit.surface.normals), 0, 1)
        share = np.minimum(mirror + 0.5 * gloss * (1 - facing) ** 5, 0.95)
        chosen = np.flatnonzero((share > MIN_REFLECTION) & ~hit.missed)
        if not len(chosen):
            return
        n, d = hit.surface.normals[chosen], hit.directions[chosen]
        rough = (0.35 / np.sqrt(sharpness[chosen]) * (sharpness[chosen] < 300))[:, None]
        n = n + rng.standard_normal(n.shape).astype(np.float32) * rough * 0.35
        n /= np.linalg.norm(n, axis=1)[:, None]
        reflected = (d - 2 * np.einsum("ij,ij->i", d, n)[:, None] * n).astype(np.float32)
        seen = self._shade(hit.surface.lifted[chosen], reflected, 200.0, (1, len(chosen)))
        light = np.broadcast_to(np.array(self._lit.ambient, np.float32), seen.albedo.shape).copy()
        for source in strongest(self._lit.lights, seen.surface, self._tracer):
            middle = np.broadcast_to(np.array(source.position_m, np.float32), n.shape)
            shadow = ~self._tracer.occluded(seen.surface.lifted, middle)
            strength = falloff(source, seen.surface, middle) * shadow
            light += strength[:, None] * np.array(source.colour, np.float32)
        glow = self._finish[seen.finish, 3][:, None] * np.float32(GLOW_STRENGTH)
        arrived = seen.albedo * (light * (1 - np.minimum(glow, 1)) + glow)
        arrived[seen.missed] = SKY
        tint = np.where(metal[chosen][:, None] > 0, hit.albedo[chosen] * 1.6, 1.0)
        part = share[chosen][:, None]
        colour[chosen] = colour[chosen] * (1 - part) + arrived * tint * part


def developed(linear: F32, look: CameraLook, rng: np.random.Generator) -> U8:
    """Linear light (H, W, 3) as a camera stores it: (H, W, 3) uint8."""
    height, width = linear.shape[:2]
    level = float(np.exp(np.log(linear.mean(axis=2) + 1e-3).mean()))
    x = (
        linear
        * np.float32(np.clip(MIDDLE_GREY / level, *EXPOSURE))
        * np.array(look.balance, np.float32)
    )
    y, across = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    x = x * (1 - look.vignette * (y**2 + across**2) / 2)[..., None]
    x = x * 0.8
    curve = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
    shown = np.clip(curve, 0, 1) ** (1 / GAMMA) + NOISE * rng.standard_normal(linear.shape)
    image = (np.clip(shown, 0, 1) * 255 + 0.5).astype(np.uint8)
    _, packed = cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    decoded = np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8)
    return np.ascontiguousarray(decoded[..., ::-1])


def _rays(T_map_camera: F64, camera: Intrinsics, width: int, height: int) -> tuple[F32, F32]:
    """Origin (3,) and directions (N, 3) float32 in the map frame, row by row."""
    T = T_map_camera.astype(np.float32)
    directions = ray_directions(camera, width, height).reshape(-1, 3) @ T[:3, :3].T
    return T[:3, 3], directions


def _linear(colours: U8) -> F32:
    """Colours of the screen as linear light, by a table of 256."""
    table = ((np.arange(256) / 255) ** GAMMA).astype(np.float32)
    linear: F32 = table[colours]
    return linear


def _texel_density(lit: LitScene) -> F32:
    """Binary logarithm of texels per metre (F,) of every face."""
    scene = lit.scene
    corners = scene.vertices[scene.faces].astype(np.float64)
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    edges = scene.face_uv[:, 1:].astype(np.float64) - scene.face_uv[:, :1]
    uv_area = np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    sizes = np.array([max(t.shape[0] * t.shape[1], 256**2) for t in scene.textures], np.float64)
    density = uv_area * sizes[scene.face_texture] / np.maximum(area, 1e-12)
    result: F32 = (0.5 * np.log2(np.maximum(density, 1e-12))).astype(np.float32)
    return result
