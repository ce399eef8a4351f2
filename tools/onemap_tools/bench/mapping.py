"""Maps of scenes made in this process: images of sampled poses, encoded and fused.

With the services' pure modules, without a bus and without a robot.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_shared.geometry import F64
from onemap_shared.messages import FeatureField, RgbdFrame
from onemap_simulator.rendering.camera_poses import sample_camera_poses
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, measured_mm
from onemap_simulator.scene.scene import Scene

CAMERA = CameraParams()
INTRINSICS = CAMERA.intrinsics
FRAME_NS = 100_000_000
MIN_OBSERVED_PIXELS = 192  # of 320 x 240, in one image: three patches of 8 x 8
MAX_OBSERVED_RANGE_M = 4.0  # beyond, the released model's confidence is below a quarter


@dataclass(frozen=True, slots=True)
class MappedScene:
    """A scene, its map, and the categories that were shown to the map well enough."""

    scene: Scene
    belief: BeliefMap
    observed: frozenset[str]


def map_scene(scene: Scene, encoder: Encoder, seed: int, images: int) -> MappedScene:
    """The map of images of ``images`` poses drawn from the seed."""
    params = MapParams()
    belief = BeliefMap(params)
    renderer = Renderer(scene)
    observed: set[str] = set()
    for sequence, pose in enumerate(
        sample_camera_poses(scene, np.random.default_rng(seed), images)
    ):
        view = renderer.render(pose, INTRINSICS, width=CAMERA.width, height=CAMERA.height)
        belief.fuse(compute_update(rendered_field(view, pose, sequence, encoder), params))
        observed |= observed_categories(scene, view)
    return MappedScene(scene, belief, frozenset(observed))


def observed_categories(scene: Scene, view: RenderedImage) -> set[str]:
    """Categories of which one object fills enough pixels within range."""
    near = view.labels[(view.labels >= 0) & (view.depth_m <= MAX_OBSERVED_RANGE_M)]
    counts = np.bincount(near, minlength=len(scene.objects))
    return {scene.objects[i].category for i in np.flatnonzero(counts >= MIN_OBSERVED_PIXELS)}


def rendered_field(
    view: RenderedImage, T_map_camera: F64, sequence: int, encoder: Encoder
) -> FeatureField:
    """The feature field that perception computes from a rendered image."""
    frame = RgbdFrame(
        sequence=sequence,
        stamp_ns=(sequence + 1) * FRAME_NS,
        rgb=view.rgb,
        depth_mm=measured_mm(view.depth_m, CAMERA.min_depth_m, CAMERA.max_depth_m),
        intrinsics=INTRINSICS,
        T_map_camera=T_map_camera,
    )
    return feature_field(frame, encoder.encode(view.rgb), encoder, VarianceParams())
