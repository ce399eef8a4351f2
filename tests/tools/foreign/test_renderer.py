"""The renderer: labels, shadows, glow, mirrors, and that an image is a function of its seed."""

from __future__ import annotations

import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import U8, camera_mount, pose_2d
from onemap_tools.foreign.finish import Finish, FinishedPart, finished, pictured
from onemap_tools.foreign.lit_scene import AreaLight, LitScene, PlacedObject, lit_scene
from onemap_tools.foreign.plain_mesh import block
from onemap_tools.foreign.renderer import ForeignRenderer

CAMERA = Intrinsics.from_fov(64, 48, 1.2)
POSE = pose_2d(0.0, -2.0, np.pi / 2) @ camera_mount(0.0, 0.8, 0.0)
GREY = Finish(np.full((4, 4, 3), 120, np.uint8))


def scene(*extra: PlacedObject, light: tuple[float, float, float] = (0.0, -1.5, 2.2)) -> LitScene:
    """A wall at y = 0 that the camera looks at, a floor, and more."""
    wall = finished(block(8, 0.1, 4, 0.0).at(y=0.05), GREY)
    floor = finished(block(8, 8, 0.1, 0.0).at(z=-0.1), GREY)
    objects = [PlacedObject("wall", "", (wall,)), PlacedObject("floor", "", (floor,)), *extra]
    lights = (AreaLight(light, (0.1, 0.1, 0.1), (2, 2, 2)),)
    return lit_scene("s", objects, lights, ambient=(0.2, 0.2, 0.2), rooms=(), start=(0, 0, 0))


def thing(part: FinishedPart) -> PlacedObject:
    """The one object that is looked at."""
    return PlacedObject("thing", "", (part,))


def render(lit: LitScene, seed: int = 1) -> U8:
    """A small image."""
    renderer = ForeignRenderer(lit)
    return renderer.render(POSE, CAMERA, width=64, height=48, rng=np.random.default_rng(seed))


def test_labels_are_those_of_the_geometry() -> None:
    cube = thing(finished(block(0.5, 0.5, 0.5, 0.0).at(0, -0.5, 0.55), GREY))
    labels = ForeignRenderer(scene(cube)).labels(POSE, CAMERA, 64, 48)
    assert labels[24, 32] == 2
    assert labels[5, 32] == 0
    assert labels[46, 32] == 1


def test_an_image_is_a_function_of_its_seed() -> None:
    np.testing.assert_array_equal(render(scene()), render(scene()))
    assert (render(scene(), 1) != render(scene(), 2)).any()


def test_a_thing_before_the_light_throws_a_shadow() -> None:
    board = thing(finished(block(1.2, 0.02, 0.5, 0.0).at(-0.9, -0.3, 1.3), GREY))
    light = (-0.9, -1.2, 2.6)
    shares = []
    for lit in (scene(board, light=light), scene(light=light)):
        image = render(lit).mean(axis=2)
        shares.append(float(image[14:19, 8:14].mean() / image[14:19, 50:56].mean()))
    assert shares[0] < 0.8 * shares[1]


def test_a_screen_glows_without_light() -> None:
    bright = np.full((8, 8, 3), 200, np.uint8)
    panel = pictured(1.0, 0.8, Finish(bright, glow=0.85))
    screen = FinishedPart(panel.mesh.at(0, -0.2, 0.6), panel.uv, panel.finish)
    image = render(scene(thing(screen), light=(0, 3, 2))).mean(axis=2)
    assert image[24, 32] > 1.8 * image[24, 3]


def test_a_mirror_shows_what_is_behind_the_camera() -> None:
    red = Finish(np.full((4, 4, 3), (230, 20, 20), np.uint8), glow=1.0)
    behind = PlacedObject("curtain", "", (finished(block(6, 0.1, 3, 0.0).at(y=-4), red),))
    silver = Finish(np.full((4, 4, 3), 200, np.uint8), sharpness=400, mirror=0.9)
    glass = pictured(1.0, 1.0, silver)
    mirror = thing(FinishedPart(glass.mesh.at(0, -0.1, 0.5), glass.uv, silver))
    seen = render(scene(behind, mirror))[24, 32].astype(int)
    assert seen[0] > seen[1] + 60
