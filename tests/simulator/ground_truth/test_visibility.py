from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_shared.geometry import F64
from onemap_simulator.ground_truth.visibility import surface_points, visible_from
from onemap_simulator.rendering.ray_tracer import RayTracer
from tests.simulator.scenes import SceneBuilder


def test_an_object_is_visible_past_an_obstacle_but_not_through_it() -> None:
    builder = (
        SceneBuilder()
        .add("wall", (1, -1, 0), (1.1, 1, 2))
        .add("ball", (3, -0.2, 0), (3.4, 0.2, 0.4))
    )
    scene = builder.build()
    eyes = np.array([(0, 0, 1), (0, 4, 1), (2, 0, 1), (3.2, 0, 1)], np.float32)
    seen = visible_from(RayTracer(scene), scene, 1, eyes)
    assert seen.tolist() == [False, True, True, True]


def test_a_part_of_the_object_does_not_hide_the_object() -> None:
    scene = SceneBuilder().add("box", (1, -1, 0), (2, 1, 2)).build()
    eyes = np.array([(0, 0, 1), (3, 0, 1)], np.float32)
    assert visible_from(RayTracer(scene), scene, 0, eyes).all()


@settings(max_examples=40, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**16))
def test_surface_points_are_spread_by_area(seed: int) -> None:
    rng = np.random.default_rng(seed)
    triangles = rng.uniform(-1, 1, (4, 3, 3))
    triangles[..., 2] = np.arange(4)[:, None]  # the height names the triangle
    points = surface_points(triangles, 400)
    share = np.bincount(points[:, 2].round().astype(int), minlength=4) / len(points)
    area = areas(triangles)
    np.testing.assert_allclose(share, area / area.sum(), atol=0.02)
    for index, triangle in enumerate(triangles):
        on_it = points[points[:, 2].round() == index]
        low, high = triangle.min(axis=0), triangle.max(axis=0)
        assert ((on_it >= low - 1e-9) & (on_it <= high + 1e-9)).all()


def test_triangles_without_area_give_their_corners() -> None:
    degenerate = np.zeros((2, 3, 3))
    assert surface_points(degenerate, 4).shape == (4, 3)


def areas(triangles: F64) -> F64:
    edges = triangles[:, 1:] - triangles[:, :1]
    area: F64 = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
    return area
