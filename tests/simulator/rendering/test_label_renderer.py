"""Labels without colours: the same labels and depth as the renderer's."""

from __future__ import annotations

import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import camera_mount, pose_2d
from onemap_simulator.rendering.label_renderer import LabelRenderer, label_colours, labels_of
from onemap_simulator.rendering.renderer import Renderer
from tests.simulator.scenes import box_room


def test_labels_and_depth_are_those_of_the_renderer() -> None:
    scene = box_room()
    T_map_camera = pose_2d(1.0, 1.0, 0.3) @ camera_mount(0.1, 1.0, 0.2)
    intrinsics = Intrinsics.from_fov(40, 30, 1.3)
    fast = LabelRenderer(scene).render(T_map_camera, intrinsics, width=40, height=30)
    full = Renderer(scene).render(T_map_camera, intrinsics, width=40, height=30)
    np.testing.assert_array_equal(fast.labels, full.labels)
    np.testing.assert_array_equal(fast.depth_m, full.depth_m)
    np.testing.assert_array_equal(labels_of(fast.rgb), full.labels)


def test_colours_keep_every_label() -> None:
    labels = np.array([[-1, 0, 254], [255, 256, 65_534]], np.int32)
    np.testing.assert_array_equal(labels_of(label_colours(labels)), labels)
