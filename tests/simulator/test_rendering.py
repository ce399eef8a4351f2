"""Images, depth and labels of a scene, and the camera that takes them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, camera_mount, check_rigid, pose_2d
from onemap_simulator.errors import DepthErrorParams
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.people import NOBODY, Bystanders
from onemap_simulator.physics.robot import RobotState
from onemap_simulator.rendering import rendered_image
from onemap_simulator.rendering.camera_poses import sample_camera_poses
from onemap_simulator.rendering.label_renderer import LabelRenderer, label_colours, labels_of
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import (
    CameraParams,
    RgbdCamera,
    SceneRenderer,
    measured_mm,
    noisy_depth,
)
from onemap_simulator.scene.scene import PointLight
from tests.reference.cylinder import marched_depth
from tests.reference.raycast import first_hits
from tests.simulator.scenes import WALL_SIDES, SceneBuilder, box_room

SCENE = box_room()
RENDERER = Renderer(SCENE)
INTRINSICS = Intrinsics.from_fov(80, 60, np.radians(79.0))


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


def rays(*rows: tuple[float, float, float]) -> F32:
    return np.array(rows, np.float32)


def test_labels_and_depth_are_those_of_the_renderer() -> None:
    T_map_camera = pose_2d(1.0, 1.0, 0.3) @ camera_mount(0.1, 1.0, 0.2)
    intrinsics = Intrinsics.from_fov(40, 30, 1.3)
    fast = LabelRenderer(SCENE).render(T_map_camera, intrinsics, width=40, height=30)
    full = RENDERER.render(T_map_camera, intrinsics, width=40, height=30)
    np.testing.assert_array_equal(fast.labels, full.labels)
    np.testing.assert_array_equal(fast.depth_m, full.depth_m)
    np.testing.assert_array_equal(labels_of(fast.rgb), full.labels)


def test_colours_keep_every_label() -> None:
    labels = np.array([[-1, 0, 254], [255, 256, 65_534]], np.int32)
    np.testing.assert_array_equal(labels_of(label_colours(labels)), labels)


def camera(noise_m: float = 0.0) -> RgbdCamera:
    params = CameraParams(width=32, height=24)
    errors = DepthErrorParams(noise_m=noise_m)
    return RgbdCamera(SCENE, RENDERER, params, np.random.default_rng(0), errors)


def test_the_camera_measures_within_its_range_only() -> None:
    pose = RobotState(1.0, 1.5, 0.0).pose
    everything = camera().capture(pose).depth_mm
    assert everything.dtype == np.uint16
    assert everything.min() > 0
    np.testing.assert_array_equal(
        measured_mm(np.array([[0.0, 0.05, 1.2345, 9.0]], np.float32), 0.1, 8.0),
        np.array([[0, 0, 1234, 0]], np.uint16),
    )


def test_depth_noise_grows_with_the_square_of_distance() -> None:
    rng = np.random.default_rng(0)
    near, far = np.full((200, 200), 1.0, np.float32), np.full((200, 200), 3.0, np.float32)
    assert np.std(noisy_depth(near, 0.002, rng) - near) == pytest.approx(0.002, rel=0.05)
    assert np.std(noisy_depth(far, 0.002, rng) - far) == pytest.approx(0.018, rel=0.05)
    assert (noisy_depth(np.zeros((4, 4), np.float32), 0.1, rng) == 0).all()
    pose = RobotState(1.0, 1.5, 0.0).pose
    clean, noisy = camera().capture(pose), camera(0.01).capture(pose)
    np.testing.assert_array_equal(clean.rgb, noisy.rgb)
    assert (clean.depth_mm != noisy.depth_mm).mean() > 0.5


def test_a_lamp_does_not_shine_through_a_wall() -> None:
    def brightness(wall: bool) -> float:
        builder = SceneBuilder().add(
            "floor", (0, 0, 0), (6, 3, 2.5), sides=("z-", "z+", *WALL_SIDES)
        )
        if wall:
            builder.add("wall", (2.9, 0, 0), (3.1, 3, 2.5))
        scene = builder.build(lights=(PointLight((1.5, 1.5, 2.3), (1.0, 1.0, 1.0)),))
        T = pose_2d(3.5, 1.5, 0) @ camera_mount(0.0, 1.0, 0.5)
        return float(Renderer(scene).render(T, INTRINSICS, width=80, height=60).rgb.mean())

    assert brightness(wall=True) < 0.9 * brightness(wall=False)


CAMERA = CameraParams(width=160, height=120)
ROOM = rendered_image.with_person(box_room())
POSE = RobotState(0.6, 1.5, 0.0).pose
AHEAD = Bystanders(np.array([[2.1, 1.5]]), 0.25, 1.7)


def seen_by(renderer: SceneRenderer, people: Bystanders) -> rendered_image.RenderedImage:
    T_map_camera = POSE @ CAMERA.mount
    return renderer.render(T_map_camera, CAMERA.intrinsics, width=160, height=120, people=people)


def test_a_person_is_seen_in_labels_colours_and_depth_before_the_wall_alone() -> None:
    views = {}
    for renderer in (LabelRenderer(ROOM), Renderer(ROOM)):
        empty, view = (seen_by(renderer, people) for people in (NOBODY, AHEAD))
        shown = view.labels == rendered_image.person_label(ROOM)
        assert 0.02 < shown.mean() < 0.3
        assert shown[60, 80]
        np.testing.assert_array_equal(view.labels[~shown], empty.labels[~shown])
        np.testing.assert_array_equal(view.rgb[~shown], empty.rgb[~shown])
        assert (view.depth_m[shown] < empty.depth_m[shown]).all()
        assert (view.faces[shown] == -1).all()
        views[type(renderer)] = view
    labels = labels_of(views[LabelRenderer].rgb)
    np.testing.assert_array_equal(labels, views[LabelRenderer].labels)
    person = views[Renderer].rgb[views[Renderer].labels == rendered_image.person_label(ROOM)]
    assert (person <= rendered_image.CLOTHES_RGB).all()
    assert np.abs(person.max(axis=0).astype(int) - rendered_image.CLOTHES_RGB).max() <= 2


def test_the_depth_is_that_of_small_steps_along_each_ray() -> None:
    rays = rendered_image.ViewRays.of(POSE @ CAMERA.mount, CAMERA.intrinsics, 160, 120)
    place = np.array([1.4, 1.2], np.float32)
    depth, facing = rendered_image.cylinder_hits(rays, place, AHEAD)
    slow = marched_depth(rays.origin, rays.directions, place, AHEAD, step_m=0.004)
    assert ((depth > 0) == (slow > 0)).mean() > 0.998
    both = (depth > 0) & (slow > 0)
    assert np.median(np.abs(depth - slow)[both]) < 0.005
    assert facing[both].max() == pytest.approx(1.0, abs=0.02)


def test_a_scene_that_names_no_person_shows_them_as_nothing_known() -> None:
    scene = box_room()
    assert rendered_image.person_label(scene) == -1
    camera = RgbdCamera(scene, LabelRenderer(scene), CAMERA, np.random.default_rng(0))
    image = camera.capture(POSE, AHEAD)
    assert labels_of(image.rgb)[60, 80] == -1
    assert 1000 < image.depth_mm[60, 80] < 1300


def test_poses_are_free_rigid_and_repeatable() -> None:
    collision = CollisionMap.of(SCENE, height_m=1.3)
    poses = sample_camera_poses(SCENE, np.random.default_rng(3), 20)
    again = sample_camera_poses(SCENE, np.random.default_rng(3), 20)
    assert len(poses) == 20
    np.testing.assert_array_equal(poses, again)
    for T in poses:
        check_rigid(T, "T_map_camera")
        assert collision.clearance_m(T[0, 3], T[1, 3]) > 0.2
        assert 0.8 <= T[2, 3] <= 1.3
