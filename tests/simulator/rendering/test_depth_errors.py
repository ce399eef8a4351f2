from __future__ import annotations

import numpy as np
import pytest

from onemap_shared.camera import ray_directions
from onemap_shared.geometry import F32
from onemap_simulator.physics.robot import RobotState
from onemap_simulator.rendering.depth_errors import (
    DepthErrorParams,
    depth_edges,
    faces_without_return,
    quantised,
    with_depth_errors,
)
from onemap_simulator.rendering.label_renderer import LabelRenderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, RgbdCamera
from tests.simulator.scenes import SceneBuilder

CAMERA = CameraParams(width=160, height=120)


def two_walls() -> F32:
    """Depth (40, 60): a wall at 3 m, to the right of column 29 one at 2 m."""
    depth = np.full((40, 60), 3.0, np.float32)
    depth[:, 30:] = 2.0
    return depth


def measured(depth: F32, params: DepthErrorParams, seed: int = 0) -> F32:
    faces = np.full(depth.shape, -1, np.int32)
    rng = np.random.default_rng(seed)
    return with_depth_errors(depth, faces, np.array([False]), params, rng)


def test_only_jumps_of_depth_are_edges_and_slanted_planes_are_not() -> None:
    edges = depth_edges(two_walls(), 0.1)
    assert edges[:, 29:31].all()
    assert not edges[:, :29].any()
    assert not edges[:, 31:].any()
    rays = ray_directions(CAMERA.intrinsics, 160, 120) @ CAMERA.mount[:3, :3].T
    floor = np.where(rays[..., 2] < -0.05, -1.0 / np.minimum(rays[..., 2], -0.05), 0.0)
    below = depth_edges(floor.astype(np.float32), 0.1)[60:]
    assert not below.any()
    assert not depth_edges(np.zeros((4, 4), np.float32), 0.1).any()


def test_pixels_at_edges_fly_between_front_and_back_or_have_no_return() -> None:
    params = DepthErrorParams(edge_flying=0.3, edge_holes=0.3)
    images = np.array([measured(two_walls(), params, seed) for seed in range(50)])
    at_edge, elsewhere = images[:, :, 29:31], np.delete(images, (29, 30), axis=2)
    assert (at_edge == 0).mean() == pytest.approx(0.3, abs=0.03)
    assert ((at_edge > 2) & (at_edge < 3)).mean() == pytest.approx(0.3, abs=0.03)
    np.testing.assert_array_equal(np.unique(elsewhere), (2.0, 3.0))
    np.testing.assert_array_equal(measured(two_walls(), params, 7), images[7])


def test_steps_grow_with_the_square_of_the_distance() -> None:
    near, far = (np.linspace(d, d + 0.5, 5000, dtype=np.float32) for d in (1.0, 4.0))
    for depth, step in ((near, 0.0028), (far, 0.0028 * 16)):
        values = np.unique(quantised(depth, 0.0028))
        assert np.diff(values)[0] == pytest.approx(step, rel=0.05)
        assert np.abs(quantised(depth, 0.0028) - depth).max() <= 0.51 * np.diff(values).max()
    assert (quantised(np.zeros(3, np.float32), 0.0028) == 0).all()


def test_glass_and_black_surfaces_give_no_return() -> None:
    black = np.full((2, 2, 3), 10, np.uint8)
    builder = SceneBuilder()
    builder.add("wall", (4, -3, 0), (4.1, 3, 3))
    builder.add("window", (3.9, -2, 0.5), (3.95, -0.5, 2))
    builder.add("television", (3.9, 0.5, 0.5), (3.95, 2, 1.5), texture=black)
    scene = builder.build()
    params = DepthErrorParams(dark_below=25.0, glass=True)
    camera = RgbdCamera.of(
        scene,
        LabelRenderer(scene),
        CAMERA.model_copy(update={"depth_errors": params}),
        np.random.default_rng(0),
    )
    image = camera.capture(RobotState(0.0, 0.0, 0.0).pose)
    labels = (
        LabelRenderer(scene).render(CAMERA.mount, CAMERA.intrinsics, width=160, height=120).labels
    )
    assert (image.depth_mm[labels == 0] > 0).all()
    assert min((labels == 1).sum(), (labels == 2).sum()) > 50
    assert (image.depth_mm[labels > 0] == 0).all()
    assert not faces_without_return(scene, DepthErrorParams()).any()
