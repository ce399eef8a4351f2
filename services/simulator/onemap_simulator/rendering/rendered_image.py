"""What a renderer returns, the rays of its pixels, and people drawn over it by ray casting."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from onemap_shared.camera import Intrinsics, ray_directions
from onemap_shared.geometry import F32, F64, I32, U8, Bool, check_rigid
from onemap_simulator.physics.people import Bystanders
from onemap_simulator.scene.scene import Scene, SceneObject

PERSON = "person"
CLOTHES_RGB = (70, 85, 120)
SIDE_LIGHT = 0.6  # brightness of a side that is seen edge-on, over that of one seen frontally


@dataclass(frozen=True, slots=True)
class RenderedImage:
    """One rendered image.

    rgb (H, W, 3) uint8; depth_m (H, W) float32 along the optical axis, 0 = nothing hit;
    labels (H, W) int32 index into the scene's objects, faces (H, W) int32 into its triangles,
    -1 = nothing hit.
    """

    rgb: U8
    depth_m: F32
    labels: I32
    faces: I32


@dataclass(frozen=True, slots=True)
class ViewRays:
    """origin (3,) in metres; directions (N, 3) in the map frame, each one optical depth long."""

    origin: F32
    directions: F32

    @classmethod
    def of(cls, T_map_camera: F64, intrinsics: Intrinsics, width: int, height: int) -> ViewRays:
        """The rays of all pixels, row by row; pixel centres at half-integer coordinates."""
        T = check_rigid(T_map_camera, "T_map_camera").astype(np.float32)
        return cls(T[:3, 3], _camera_rays(intrinsics, width, height) @ T[:3, :3].T)


@lru_cache(maxsize=8)
def _camera_rays(intrinsics: Intrinsics, width: int, height: int) -> F32:
    """``ray_directions`` of all pixels as (H * W, 3), row by row; cached, therefore read-only."""
    rays = ray_directions(intrinsics, width, height).reshape(-1, 3)
    rays.flags.writeable = False
    return rays


@dataclass(frozen=True, slots=True)
class PersonLook:
    """label and rgb (3,) of all people; flat: exactly this colour, as labels need it."""

    label: int
    rgb: ArrayLike
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
    shape = image.depth_m.shape
    for place in people.places.astype(np.float32):
        depth, facing = cylinder_hits(rays, place, people)
        depth_m = depth.reshape(shape)
        shown: Bool = (depth_m > 0) & ((image.depth_m == 0) | (depth_m < image.depth_m))
        light = np.ones_like(facing) if look.flat else SIDE_LIGHT + (1 - SIDE_LIGHT) * facing
        colours = (np.asarray(look.rgb, np.float32) * light[:, None]).astype(np.uint8)
        image = RenderedImage(
            rgb=np.where(shown[..., None], colours.reshape(*shape, 3), image.rgb),
            depth_m=np.where(shown, depth_m, image.depth_m),
            labels=np.where(shown, np.int32(look.label), image.labels),
            faces=np.where(shown, np.int32(-1), image.faces),
        )
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
