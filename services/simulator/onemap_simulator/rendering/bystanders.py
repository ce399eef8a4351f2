"""People in an image: upright cylinders, drawn over the rendered scene by ray casting."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from onemap_shared.geometry import F32, Bool
from onemap_simulator.physics.people import Bystanders
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.scene.scene import Scene, SceneObject

PERSON = "person"
CLOTHES_RGB = (70, 85, 120)
SIDE_LIGHT = 0.6  # brightness of a side that is seen edge-on, over that of one seen frontally


@dataclass(frozen=True, slots=True)
class ViewRays:
    """origin (3,) in metres; directions (N, 3) in the map frame, each one optical depth long."""

    origin: F32
    directions: F32


@dataclass(frozen=True, slots=True)
class PersonLook:
    """label and rgb (3,) of all people; flat: exactly this colour, as labels need it."""

    label: int
    rgb: tuple[int, int, int]
    flat: bool


def with_person(scene: Scene) -> Scene:
    """The scene with an object that stands for all people and has no triangles."""
    return replace(scene, objects=(*scene.objects, SceneObject(PERSON)))


def person_label(scene: Scene) -> int:
    """Index of the scene's person among its objects, -1 if it has none."""
    named = [index for index, thing in enumerate(scene.objects) if thing.category == PERSON]
    return named[-1] if named else -1


def with_bystanders(
    image: RenderedImage, rays: ViewRays, people: Bystanders, look: PersonLook
) -> RenderedImage:
    """The image with the people that stand before what it shows."""
    for place in people.places.astype(np.float32):
        depth, facing = cylinder_hits(rays, place, people)
        shown: Bool = (depth > 0) & ((image.depth_m.ravel() == 0) | (depth < image.depth_m.ravel()))
        if shown.any():
            image = _drawn(image, depth, facing, shown, look)
    return image


def cylinder_hits(rays: ViewRays, place: F32, people: Bystanders) -> tuple[F32, F32]:
    """Depth (N,) of one person on each ray, 0 without a hit, and how frontally (N,) it is hit.

    From above the head and from within the cylinder nothing is hit: cameras are lower, and outside.
    """
    towards = rays.origin[:2] - place
    flat = rays.directions[:, :2]
    a = np.maximum((flat**2).sum(axis=1), np.float32(1e-12))
    b = flat @ towards
    root = b**2 - a * (towards @ towards - np.float32(people.radius_m**2))
    depth = (-b - np.sqrt(np.maximum(root, 0))) / a
    height = rays.origin[2] + depth * rays.directions[:, 2]
    hit = (root > 0) & (depth > 0) & (height >= 0) & (height <= people.height_m)
    facing = np.sqrt(np.maximum(root, 0) / a) / np.float32(people.radius_m)
    return np.where(hit, depth, np.float32(0)), facing


def _drawn(
    image: RenderedImage, depth: F32, facing: F32, shown: Bool, look: PersonLook
) -> RenderedImage:
    shape = image.depth_m.shape
    mask = shown.reshape(shape)
    light = np.float32(1) if look.flat else SIDE_LIGHT + (1 - SIDE_LIGHT) * facing
    colours = np.asarray(look.rgb, np.float32) * np.broadcast_to(light, shown.shape)[:, None]
    return RenderedImage(
        rgb=np.where(mask[..., None], colours.astype(np.uint8).reshape(*shape, 3), image.rgb),
        depth_m=np.where(mask, depth.reshape(shape), image.depth_m),
        labels=np.where(mask, np.int32(look.label), image.labels),
        faces=np.where(mask, np.int32(-1), image.faces),
    )
