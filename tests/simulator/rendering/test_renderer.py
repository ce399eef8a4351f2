from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_shared.camera import Intrinsics, unproject
from onemap_shared.geometry import camera_mount, pose_2d, transform
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.rendering.renderer import Renderer
from tests.reference.raycast import first_hits
from tests.simulator.scenes import SceneBuilder, box_room

SCENE = box_room()
RENDERER = Renderer(SCENE)
INTRINSICS = Intrinsics.from_fov(80, 60, np.radians(79.0))


def view_from(x: float, y: float, yaw: float, pitch_down: float = 0.2) -> RenderedImage:
    T = pose_2d(x, y, yaw) @ camera_mount(0.0, 1.0, pitch_down)
    return RENDERER.render(T, INTRINSICS, width=80, height=60)


@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    x=st.floats(0.3, 2.2),
    y=st.floats(0.3, 2.7),
    yaw=st.floats(-np.pi, np.pi),
    pitch=st.floats(-0.5, 0.9),
)
def test_agrees_with_every_ray_against_every_triangle(
    x: float, y: float, yaw: float, pitch: float
) -> None:
    T = pose_2d(x, y, yaw) @ camera_mount(0.0, 1.2, pitch)
    intrinsics = Intrinsics.from_fov(16, 12, 1.4)
    view = RENDERER.render(T, intrinsics, width=16, height=12)
    depth, face = first_hits(SCENE.vertices, SCENE.faces, T, intrinsics, (16, 12))
    assert view.depth_m.dtype == np.float32
    assert view.labels.dtype == np.int32
    # A ray along an edge may see either side of it in float32: at most one pixel here.
    labels = np.where(face >= 0, SCENE.face_object[face], -1)
    assert (view.labels != labels).sum() <= 1
    assert (np.abs(view.depth_m - depth) > 1e-4 * np.maximum(depth, 1)).sum() <= 1


def test_left_is_left_and_up_is_up() -> None:
    view = view_from(0.4, 1.5, 0.0, pitch_down=0.0)
    columns, rows = np.meshgrid(np.arange(80), np.arange(60))
    masks = {obj.category: view.labels == index for index, obj in enumerate(SCENE.objects)}
    assert columns[masks["sofa"]].mean() < 40 < columns[masks["ball"]].mean()
    assert rows[masks["ceiling"]].mean() < 30 < rows[masks["floor"]].mean()
    red, green = view.rgb[masks["sofa"]].mean(axis=0), view.rgb[masks["ball"]].mean(axis=0)
    assert red[0] > 2 * red[1]
    assert green[1] > 2 * green[0]


def test_depth_unprojects_onto_the_geometry() -> None:
    T = pose_2d(0.5, 1.2, 0.3) @ camera_mount(0.1, 1.0, 0.3)
    view = RENDERER.render(T, INTRINSICS, width=80, height=60)
    points = transform(T, unproject(view.depth_m, INTRINSICS).astype(np.float64))
    floor = view.labels == 0
    assert floor.any()
    np.testing.assert_allclose(points[floor, 2], 0.0, atol=1e-4)
    assert points.reshape(-1, 3).min() > -1e-4
    assert (points.reshape(-1, 3).max(axis=0) < np.array([4, 3, 2.5]) + 1e-4).all()


def test_a_ray_that_leaves_the_scene_has_no_depth_and_no_label() -> None:
    scene = SceneBuilder().add("floor", (0, 0, 0), (4, 3, 0.1), sides=("z-",)).build(lights=())
    view = Renderer(scene).render(
        pose_2d(0, 1, 0) @ camera_mount(0.0, 1.0, 0.0), INTRINSICS, width=80, height=60
    )
    sky = view.labels == -1
    assert sky[:30].all()
    assert (view.depth_m[sky] == 0).all()
    assert (view.depth_m[~sky] > 0).all()


def test_texture_is_the_right_way_up() -> None:
    """v = 0 is the texture's first row; the wall's quad puts it at its bottom edge (z-)."""
    texture = np.zeros((2, 2, 3), np.uint8)
    texture[0, 0], texture[0, 1], texture[1, 0], texture[1, 1] = 50, 100, 150, 200
    scene = (
        SceneBuilder().add("picture", (2, -1, 0), (2.1, 1, 2), sides=("x-",), texture=texture)
    ).build(lights=())
    view = Renderer(scene).render(
        pose_2d(0, 0, 0) @ camera_mount(0.0, 1.0, 0.0), INTRINSICS, width=80, height=60
    )
    # The side x- runs u from z = 0 up, v from y = -1 (right in the image) to y = 1 (left).
    shade = view.rgb[..., 0] / 0.4
    np.testing.assert_allclose(
        [shade[45, 60], shade[15, 60], shade[45, 20], shade[15, 20]], [50, 100, 150, 200], atol=3
    )


def test_far_patterns_do_not_flicker() -> None:
    """A fine checkerboard far away shows its mean, not single texels."""
    checker = (np.indices((64, 64)).sum(axis=0) % 2 * 255).astype(np.uint8)
    texture = np.repeat(checker[:, :, None], 3, axis=2)
    scene = (
        SceneBuilder().add("wall", (8, -0.5, 0.5), (8.1, 0.5, 1.5), sides=("x-",), texture=texture)
    ).build(lights=())
    view = Renderer(scene).render(
        pose_2d(0, 0, 0) @ camera_mount(0.0, 1.0, 0.0), INTRINSICS, width=80, height=60
    )
    wall = view.rgb[view.labels == 0].astype(float) / 0.4
    assert len(wall) > 20
    np.testing.assert_allclose(wall, 127.5, atol=4)


def test_refuses_a_pose_that_is_not_rigid() -> None:
    with pytest.raises(ValueError, match="not rigid"):
        RENDERER.render(2 * np.diag([1.0, 1, 1, 0.5]), INTRINSICS, width=8, height=6)
