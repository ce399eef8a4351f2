"""Light that the simulator's renderer leaves out: reflections, highlights, corners, bounces.

Added to a rendered image from its depth and faces alone, so that the simulator stays as fast
and as plain as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from onemap_shared.camera import Intrinsics, ray_directions
from onemap_shared.geometry import F32, F64, U8
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.scene.scene import STRUCTURE, Scene

LAMP_REACH_M = 4.5  # farther lamps hang in other rooms
STRUCTURE_GLOSS = 0.15  # of walls, floors and ceilings over that of furniture
MEAN_LEVEL = (70.0, 140.0)  # that a camera's exposure aims at, of 255
MAX_GAIN = 3.5  # of an exposure
BRIGHT_SPOTS = 6  # windows and lamps that a shiny surface shows


@dataclass(frozen=True, slots=True)
class Gloss:
    """How a scene shines.

    reflect (F + 1,) float32: share of light that each face mirrors straight on, 0 for a miss;
    hardness (F + 1,) float32: exponent of highlights; normals (F + 1, 3) float32; spots (S, 3)
    unit directions, sharpness (S,) and colours (S, 3) of the surroundings; base (3,) their mean.
    lamps (L, 3) metres; sky (2, 3) float32: RGB 0 to 255 at the horizon and above, where a ray
    leaves the scene. corners, bounce: strength of dark corners and of bounced light. level: mean
    brightness that the camera's exposure aims at, 0: none.
    """

    reflect: F32
    hardness: F32
    normals: F32
    spots: F32
    sharpness: F32
    colours: F32
    base: F32
    lamps: F32
    sky: F32
    corners: float
    bounce: float
    level: float

    @classmethod
    def of(cls, scene: Scene, rng: np.random.Generator, share: float) -> Gloss:
        """Random gloss for ``share`` of the scene's materials, and random surroundings."""
        count = len(scene.textures)
        # Varnish and glass mirror a few percent, steel half and more.
        strength = np.where(rng.random(count) < 0.3, rng.uniform(0.2, 0.7, count), 0.0)
        strength = np.maximum(strength, rng.uniform(0.01, 0.12, count))
        strength *= rng.random(count) < share
        per_object = np.array(
            [STRUCTURE_GLOSS if o.category in STRUCTURE else 1.0 for o in scene.objects]
        )
        reflect = strength[scene.face_texture] * per_object[scene.face_object]
        hardness = np.exp(rng.uniform(1.5, 5, count))[scene.face_texture]
        a, b, c = (scene.vertices[scene.faces[:, i]].astype(np.float64) for i in range(3))
        normals = np.cross(b - a, c - a)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        spots = rng.normal(size=(BRIGHT_SPOTS, 3))
        spots /= np.linalg.norm(spots, axis=1, keepdims=True)
        return cls(
            reflect=np.append(reflect, 0).astype(np.float32),
            hardness=np.append(hardness, 1).astype(np.float32),
            normals=np.vstack([normals, [0, 0, 1]]).astype(np.float32),
            spots=spots.astype(np.float32),
            sharpness=rng.uniform(2, 25, BRIGHT_SPOTS).astype(np.float32),
            colours=rng.uniform(-0.5, 1.2, (BRIGHT_SPOTS, 3)).astype(np.float32),
            base=rng.uniform(0.15, 0.6, 3).astype(np.float32),
            lamps=np.array([light.position_m for light in scene.lights], np.float32).reshape(-1, 3),
            sky=rng.uniform(60, 255, (2, 3)).astype(np.float32),
            corners=float(rng.uniform(0.0, 0.6)),
            bounce=float(rng.uniform(0.0, 0.35)),
            level=float(rng.uniform(*MEAN_LEVEL)),
        )


def shine(view: RenderedImage, gloss: Gloss, T_map_camera: F64, intrinsics: Intrinsics) -> U8:
    """The image (H, W, 3) uint8 with reflections, dark corners, bounced light and a sky."""
    height, width = view.depth_m.shape
    T = T_map_camera.astype(np.float32)
    rays = ray_directions(intrinsics, width, height).reshape(-1, 3).astype(np.float32)
    directions = rays @ T[:3, :3].T
    faces = view.faces.ravel()
    image = view.rgb.reshape(-1, 3).astype(np.float32)
    image = _with_sky(image, faces, directions, gloss)
    image = image * _corners(view.depth_m, gloss.corners).reshape(-1, 1)
    image = _bounced(image.reshape(height, width, 3), gloss.bounce).reshape(-1, 3)
    shiny = np.flatnonzero(gloss.reflect[faces] > 0)
    points = T[:3, 3] + directions[shiny] * view.depth_m.ravel()[shiny, None]
    image[shiny] = _reflected(image[shiny], faces[shiny], (points, directions[shiny]), gloss)
    gain = np.clip(gloss.level / max(float(image.mean()), 1.0), 1 / MAX_GAIN, MAX_GAIN)
    exposed = image * np.float32(gain) if gloss.level else image
    result: U8 = np.clip(exposed, 0, 255).astype(np.uint8).reshape(height, width, 3)
    return result


def _reflected(image: F32, faces: np.ndarray, rays: tuple[F32, F32], gloss: Gloss) -> F32:
    """Colours (N, 3) with what their faces mirror; Schlick's approximation of Fresnel."""
    points, directions = rays
    ahead = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    normals = gloss.normals[faces]
    facing = np.einsum("ij,ij->i", normals, ahead)
    mirrored = ahead - 2 * facing[:, None] * normals
    straight = gloss.reflect[faces]
    share = straight + (1 - straight) * 0.6 * (1 - np.abs(facing)) ** 5
    near = np.maximum(mirrored @ gloss.spots.T - 1, -2) * gloss.sharpness
    around = np.maximum(gloss.base + np.exp(near) @ gloss.colours, 0)
    lit = np.zeros(len(points), np.float32)
    for lamp in gloss.lamps:
        to = lamp - points
        apart = np.maximum(np.linalg.norm(to, axis=1), 1e-3)
        aligned = np.maximum(np.einsum("ij,ij->i", to, mirrored) / apart, 0)
        lit += aligned ** gloss.hardness[faces] * (apart < LAMP_REACH_M)
    light = np.minimum(around + lit[:, None], 1.6) * 255
    mixed: F32 = image * (1 - share[:, None]) + light * share[:, None]
    return mixed


def _with_sky(image: F32, faces: np.ndarray, directions: F32, gloss: Gloss) -> F32:
    """Colours (N, 3) with a sky where nothing was hit."""
    out = faces < 0
    if not out.any():
        return image
    up = directions[out, 2] / np.linalg.norm(directions[out], axis=1)
    share = np.clip(up, 0, 1)[:, None]
    result: F32 = image.copy()
    result[out] = gloss.sky[0] * (1 - share) + gloss.sky[1] * share
    return result


def _corners(depth_m: F32, strength: float) -> F32:
    """Factor (H, W) of light: darker where the surroundings are nearer.

    Luft et al., "Image enhancement by unsharp masking the depth buffer" (2006).
    """
    inverse = 1 / np.maximum(depth_m, 0.2)
    small = cv2.resize(inverse, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
    around = cv2.resize(cv2.blur(small, (9, 9)), depth_m.shape[::-1])
    hidden = np.clip((around / inverse - 1) * 2, 0, 1)
    factor: F32 = (1 - np.float32(strength) * hidden).astype(np.float32)
    return factor


def _bounced(image: F32, strength: float) -> F32:
    """The image plus light of the colours around."""
    small = cv2.resize(image, None, fx=0.125, fy=0.125, interpolation=cv2.INTER_AREA)
    around = cv2.resize(cv2.blur(small, (11, 11)), image.shape[1::-1])
    result: F32 = image * np.float32(1 - 0.5 * strength) + np.float32(strength) * around * (
        image / 255
    )
    return result
