from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_shared.camera import ray_directions
from onemap_simulator.physics.people import NOBODY, Bystanders
from onemap_simulator.physics.robot import RobotState
from onemap_simulator.rendering.bystanders import (
    CLOTHES_RGB,
    ViewRays,
    cylinder_hits,
    person_label,
    with_person,
)
from onemap_simulator.rendering.label_renderer import LabelRenderer, label_colour, labels_of
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, RgbdCamera, SceneRenderer
from tests.reference.cylinder import marched_depth
from tests.simulator.scenes import box_room

CAMERA = CameraParams(width=160, height=120)
ROOM = with_person(box_room())
POSE = RobotState(0.6, 1.5, 0.0).pose
AHEAD = Bystanders(np.array([[2.1, 1.5]]), 0.25, 1.7)


def seen_by(renderer: SceneRenderer, people: Bystanders) -> RenderedImage:
    T_map_camera = POSE @ CAMERA.mount
    return renderer.render(T_map_camera, CAMERA.intrinsics, width=160, height=120, people=people)


def test_a_person_is_seen_in_labels_colours_and_depth_before_the_wall_alone() -> None:
    views = {}
    for renderer in (LabelRenderer(ROOM), Renderer(ROOM)):
        empty, view = (seen_by(renderer, people) for people in (NOBODY, AHEAD))
        shown = view.labels == person_label(ROOM)
        assert 0.02 < shown.mean() < 0.3
        assert shown[60, 80]
        np.testing.assert_array_equal(view.labels[~shown], empty.labels[~shown])
        np.testing.assert_array_equal(view.rgb[~shown], empty.rgb[~shown])
        assert (view.depth_m[shown] < empty.depth_m[shown]).all()
        assert (view.faces[shown] == -1).all()
        views[type(renderer)] = view
    labels = labels_of(views[LabelRenderer].rgb)
    np.testing.assert_array_equal(labels, views[LabelRenderer].labels)
    person = views[Renderer].rgb[views[Renderer].labels == person_label(ROOM)]
    assert (person <= CLOTHES_RGB).all()
    assert np.abs(person.max(axis=0).astype(int) - CLOTHES_RGB).max() <= 2


def test_behind_the_sofa_only_the_upper_part_of_a_person_is_seen() -> None:
    behind = replace(AHEAD, places=np.array([[3.6, 2.4]]))
    T = RobotState(0.6, 2.4, 0.0).pose @ CAMERA.mount
    view = LabelRenderer(ROOM).render(T, CAMERA.intrinsics, width=160, height=120, people=behind)
    rows = np.flatnonzero((view.labels == person_label(ROOM)).any(axis=1))
    sofa = np.flatnonzero((view.labels == 3).any(axis=1))
    assert len(rows)
    assert rows.max() <= sofa.max()


def test_the_depth_is_that_of_small_steps_along_each_ray() -> None:
    T = (POSE @ CAMERA.mount).astype(np.float32)
    directions = ray_directions(CAMERA.intrinsics, 160, 120).reshape(-1, 3) @ T[:3, :3].T
    rays = ViewRays(T[:3, 3], directions)
    place = np.array([1.4, 1.2], np.float32)
    depth, facing = cylinder_hits(rays, place, AHEAD)
    slow = marched_depth(rays.origin, directions, place, AHEAD, step_m=0.004)
    assert ((depth > 0) == (slow > 0)).mean() > 0.998
    both = (depth > 0) & (slow > 0)
    assert np.median(np.abs(depth - slow)[both]) < 0.005
    assert facing[both].max() == pytest.approx(1.0, abs=0.02)


def test_a_scene_that_names_no_person_shows_them_as_nothing_known() -> None:
    scene = box_room()
    assert person_label(scene) == -1
    assert label_colour(-1) == (0, 0, 0)
    image = RgbdCamera(LabelRenderer(scene), CAMERA, np.random.default_rng(0)).capture(POSE, AHEAD)
    assert labels_of(image.rgb)[60, 80] == -1
    assert 1000 < image.depth_mm[60, 80] < 1300
