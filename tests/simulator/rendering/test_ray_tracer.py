from __future__ import annotations

import numpy as np
import pytest

from onemap_shared.geometry import F32
from onemap_simulator.rendering.ray_tracer import RayTracer
from tests.simulator.scenes import box_room

SCENE = box_room()
TRACER = RayTracer(SCENE)


def rays(*rows: tuple[float, float, float]) -> F32:
    return np.array(rows, np.float32)


def test_a_hit_gives_object_distance_and_barycentric_weights() -> None:
    hits = TRACER.first_hits(rays((1.0, 2.4, 0.4), (1.0, 2.4, 0.4)), rays((1, 0, 0), (0, 0, -2)))
    categories = [SCENE.objects[SCENE.face_object[face]].category for face in hits.face]
    assert categories == ["sofa", "floor"]
    np.testing.assert_allclose(hits.distance, (1.5, 0.2), rtol=1e-5)  # in lengths of the direction
    corners = SCENE.vertices[SCENE.faces[hits.face]]
    weights = np.stack([1 - hits.u - hits.v, hits.u, hits.v], axis=1)
    points = np.einsum("nk,nkd->nd", weights, corners)
    np.testing.assert_allclose(points, [(2.5, 2.4, 0.4), (1.0, 2.4, 0.0)], atol=1e-5)


def test_a_ray_that_leaves_the_scene_hits_nothing() -> None:
    hits = TRACER.first_hits(rays((5.0, 1.0, 1.0)), rays((1, 0, 0)))
    assert hits.face.tolist() == [-1]
    assert hits.distance.tolist() == [0.0]


@pytest.mark.parametrize(
    ("end", "blocked"),
    [((3.6, 1.5, 0.5), False), ((3.6, 2.4, 0.5), True), ((4.5, 1.5, 0.5), True)],
)
def test_occlusion_between_two_points(end: tuple[float, float, float], blocked: bool) -> None:
    assert TRACER.occluded(rays((1.0, 2.4, 0.5)), rays(end)).tolist() == [blocked]


def test_the_surfaces_of_the_end_points_do_not_occlude() -> None:
    assert not TRACER.occluded(rays((0.0, 1.5, 1.0)), rays((4.0, 1.5, 1.0)))[0]
