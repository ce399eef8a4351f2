"""Texture and uv of a loaded mesh: its own, from its vertex or face colours, or one colour."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import trimesh

from onemap_shared.geometry import F32, U8

MAX_TEXTURE_PX = 1024  # larger images are shrunk: no detail of a 640 x 480 frame is lost
COLOUR_STEP = 8  # colours per vertex are rounded to this many levels of 255
PLAIN_GREY = (180, 180, 180)


def texture_and_uv(mesh: Any) -> tuple[U8, F32]:
    """A texture (h, w, 3) uint8 RGB and the corners' uv (F, 3, 2) float32 of a trimesh mesh.

    v = 0 is the image's first row. A texture needs uv; without, its mean colour is used.
    """
    visual = mesh.visual
    if isinstance(visual, trimesh.visual.TextureVisuals):
        material = visual.material
        image, tint = _image_of(material), _tint_of(material)
        if image is None:
            return _plain(tint, len(mesh.faces))
        tinted = (image * (np.asarray(tint) / 255.0) + 0.5).astype(np.uint8)
        if visual.uv is None or len(visual.uv) != len(mesh.vertices):
            mean = tinted.reshape(-1, 3).mean(axis=0)
            return _plain((int(mean[0]), int(mean[1]), int(mean[2])), len(mesh.faces))
        uv = np.asarray(visual.uv, dtype=np.float32)[mesh.faces]
        uv = np.nan_to_num(uv)
        return tinted, np.stack([uv[..., 0], 1.0 - uv[..., 1]], axis=-1)  # trimesh's v points up
    if visual.kind in ("vertex", "face"):
        return _from_colours(np.asarray(visual.face_colors)[:, :3])
    return _plain(PLAIN_GREY, len(mesh.faces))


def _image_of(material: Any) -> U8 | None:
    image = getattr(material, "baseColorTexture", None)
    if image is None:
        image = getattr(material, "image", None)
    if image is None:
        return None
    pixels = np.asarray(image.convert("RGB"), dtype=np.uint8)
    scale = MAX_TEXTURE_PX / max(pixels.shape[:2])
    if scale < 1.0:
        pixels = cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA).astype(
            np.uint8
        )
    return pixels


def _tint_of(material: Any) -> tuple[int, int, int]:
    """The material's base colour, 0 to 255; white for a textured material without one."""
    for name in ("baseColorFactor", "diffuse"):
        colour = getattr(material, name, None)
        if colour is not None and not (name == "diffuse" and _image_of(material) is not None):
            values = np.asarray(colour, dtype=np.float64)[:3]
            if np.issubdtype(np.asarray(colour).dtype, np.floating) and values.max() <= 1.0:
                values = values * 255
            red, green, blue = np.clip(values, 0, 255).astype(int).tolist()
            return (red, green, blue)
    return (255, 255, 255) if _image_of(material) is not None else PLAIN_GREY


def _plain(colour: tuple[int, int, int], faces: int) -> tuple[U8, F32]:
    return np.full((4, 4, 3), colour, np.uint8), np.full((faces, 3, 2), 0.5, np.float32)


def _from_colours(colours: U8) -> tuple[U8, F32]:
    """One texel per distinct colour, rounded; every face (F, 3) lies wholly within its texel."""
    rounded = colours.astype(np.int64) // COLOUR_STEP * COLOUR_STEP + COLOUR_STEP // 2
    palette, index = np.unique(rounded, axis=0, return_inverse=True)
    index = index.reshape(-1)
    side = int(np.ceil(np.sqrt(len(palette))))
    image = np.zeros((side * side, 3), np.uint8)
    image[: len(palette)] = palette
    centre = np.stack([index % side + 0.5, index // side + 0.5], axis=-1) / side
    uv = np.repeat(centre[:, None], 3, axis=1).astype(np.float32)
    return image.reshape(side, side, 3), uv
