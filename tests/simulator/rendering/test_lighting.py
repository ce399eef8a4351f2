from __future__ import annotations

import numpy as np

from onemap_shared.camera import Intrinsics, unproject
from onemap_shared.geometry import F32, camera_mount, pose_2d, transform
from onemap_simulator.rendering.lighting import HALF_DISTANCE_M, HEMISPHERE, LightMap
from onemap_simulator.rendering.ray_tracer import RayTracer
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.scene.scene import PointLight
from tests.simulator.scenes import WALL_SIDES, SceneBuilder

INTRINSICS = Intrinsics.from_fov(80, 60, np.radians(79.0))
UP = (0.0, 0.0, 1.0)


def irradiance(at: tuple[float, float, float], normal: tuple[float, float, float]) -> F32:
    """RGB (3,) at a point of an empty hall with one white lamp at (5, 5, 3)."""
    builder = SceneBuilder().add("floor", (0, 0, 0), (10, 10, 4), sides=("z-", "z+", *WALL_SIDES))
    scene = builder.build(lights=(PointLight((5.0, 5.0, 3.0), (1.0, 1.0, 1.0)),))
    light = LightMap.of(scene, RayTracer(scene).occluded)
    planes = [
        np.broadcast_to(np.array(v, np.float32)[:, None, None], (3, 4, 4)) for v in (at, normal)
    ]
    value: F32 = light.irradiance(*planes)[:, 2, 2]
    return value


def test_light_falls_with_distance_and_angle() -> None:
    below = irradiance((5.0, 5.0, 0.0), UP) - 0.4 * (1 + HEMISPHERE)
    np.testing.assert_allclose(below, 1.0 / (1.0 + (3.0 / HALF_DISTANCE_M) ** 2), rtol=0.02)
    aside = irradiance((5.0, 8.0, 0.0), UP) - 0.4 * (1 + HEMISPHERE)
    expected = np.sqrt(0.5) / (1.0 + 18.0 / HALF_DISTANCE_M**2)
    np.testing.assert_allclose(aside, expected, rtol=0.05)


def test_a_surface_that_faces_away_gets_ambient_light_only() -> None:
    np.testing.assert_allclose(
        irradiance((5.0, 5.0, 1.0), (0.0, 0.0, -1.0)), 0.4 * (1 - HEMISPHERE), rtol=1e-5
    )


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


def test_objects_cast_a_shadow_below_them() -> None:
    def floor_brightness(table: bool) -> float:
        builder = SceneBuilder().add("floor", (0, 0, 0), (6, 3, 2.5), sides=("z-", *WALL_SIDES))
        if table:
            builder.add("table", (2.2, 1.0, 0.7), (3.2, 2.0, 0.72))
        scene = builder.build(lights=(PointLight((2.7, 1.5, 2.3), (1.0, 1.0, 1.0)),))
        T = pose_2d(1.0, 1.5, 0) @ camera_mount(0.0, 0.4, 0.2)
        view = Renderer(scene).render(T, INTRINSICS, width=80, height=60)
        points = transform(T, unproject(view.depth_m, INTRINSICS).astype(np.float64))
        below = (np.abs(points[..., :2] - (2.7, 1.5)) < 0.3).all(axis=-1) & (points[..., 2] < 0.01)
        assert below.any()
        return float(view.rgb[below].mean())

    assert floor_brightness(table=True) < 0.8 * floor_brightness(table=False)
