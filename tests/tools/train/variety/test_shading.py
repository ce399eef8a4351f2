"""Reflections, corners, bounced light and sky are added where they belong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import U8, camera_mount, pose_2d
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.rendering.renderer import Renderer
from onemap_tools.train.variety.shading import Gloss, shine
from tests.simulator.scenes import box_room

SCENE = box_room()
CAMERA = Intrinsics.from_fov(64, 48, 1.3)
POSE = pose_2d(SCENE.start[0], SCENE.start[1], SCENE.start[2]) @ camera_mount(0.0, 1.0, 0.1)
VIEW = Renderer(SCENE).render(POSE, CAMERA, width=64, height=48)
DULL = replace(
    Gloss.of(SCENE, np.random.default_rng(0), share=0.0), corners=0.0, bounce=0.0, level=0.0
)


def shone(gloss: Gloss, view: RenderedImage = VIEW) -> U8:
    return shine(view, gloss, POSE, CAMERA)


def test_without_gloss_the_picture_stays_as_it_is() -> None:
    np.testing.assert_array_equal(shone(DULL), VIEW.rgb)


def test_a_mirror_shows_its_surroundings_and_a_dull_wall_does_not() -> None:
    reflect = np.where(np.arange(len(DULL.reflect)) < len(DULL.reflect) // 2, 0.8, 0.0)
    shiny = replace(DULL, reflect=reflect.astype(np.float32))
    changed = (shone(shiny) != VIEW.rgb).any(axis=2)
    mirrors = reflect[VIEW.faces] > 0
    assert mirrors.any()
    assert not mirrors.all()
    assert changed[mirrors].mean() > 0.9
    assert not changed[~mirrors].any()


def test_a_sky_stands_where_nothing_was_hit() -> None:
    faces = VIEW.faces.copy()
    faces[:10] = -1
    image = shone(DULL, replace(VIEW, faces=faces))
    assert (image[:10].astype(int) >= np.floor(DULL.sky.min(axis=0)).astype(int)).all()
    np.testing.assert_array_equal(image[10:], VIEW.rgb[10:])


def test_corners_get_darker_and_exposure_reaches_its_level() -> None:
    dark = shone(replace(DULL, corners=0.6))
    assert (dark <= VIEW.rgb).all()
    assert dark.mean() < VIEW.rgb.mean()
    for level in (80.0, 120.0):
        exposed = shone(replace(DULL, level=level))
        assert exposed.mean() == pytest.approx(level, rel=0.15)


def test_gloss_is_a_function_of_the_generator_and_spares_most_materials() -> None:
    first, again = (Gloss.of(SCENE, np.random.default_rng(4), 0.5) for _ in range(2))
    np.testing.assert_array_equal(first.reflect, again.reflect)
    assert first.reflect.max() <= 0.7
    assert first.reflect[-1] == 0
    np.testing.assert_array_equal(shone(first), shone(again))
