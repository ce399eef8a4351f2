"""Object labels and depth of a scene without colours: a quarter of the time of the renderer.

For perception that is simulated too: the labels travel as the colours of the image.
"""

from __future__ import annotations

import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F64, I32, U8
from onemap_simulator.physics.people import NOBODY, Bystanders
from onemap_simulator.rendering.ray_tracer import RayTracer
from onemap_simulator.rendering.rendered_image import (
    PersonLook,
    RenderedImage,
    ViewRays,
    person_label,
    with_bystanders,
)
from onemap_simulator.scene.scene import Scene


class LabelRenderer:
    """Renders one scene as ``Renderer`` does, with ``label_colours`` in place of colours."""

    def __init__(self, scene: Scene) -> None:
        self._tracer = RayTracer(scene)
        self._objects: I32 = np.append(scene.face_object, -1).astype(np.int32)
        label = person_label(scene)
        colour = label_colours(np.array([[label]], np.int32))[0, 0]
        self._person = PersonLook(label, colour, flat=True)

    def render(
        self,
        T_map_camera: F64,
        intrinsics: Intrinsics,
        *,
        width: int,
        height: int,
        people: Bystanders = NOBODY,
    ) -> RenderedImage:
        """Labels, their colours and depth at T_map_camera (4, 4)."""
        rays, shape = ViewRays.of(T_map_camera, intrinsics, width, height), (height, width)
        hits = self._tracer.hits_of(rays.origin, rays.directions)
        labels = self._objects[hits.face].reshape(shape)
        distance, face = hits.distance.reshape(shape), hits.face.reshape(shape)
        image = RenderedImage(label_colours(labels), distance, labels, face)
        return with_bystanders(image, rays, people, self._person)


def label_colours(labels: I32) -> U8:
    """Labels (H, W) in [-1, 65534] as colours (H, W, 3): label + 1, low byte first."""
    code = labels + 1
    colours: U8 = np.stack([code & 255, code >> 8, np.zeros_like(code)], axis=-1).astype(np.uint8)
    return colours


def labels_of(colours: U8) -> I32:
    """The labels (H, W) int32 of ``label_colours``."""
    labels: I32 = colours[..., 0].astype(np.int32) + 256 * colours[..., 1].astype(np.int32) - 1
    return labels
