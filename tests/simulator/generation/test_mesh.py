"""Primitives are closed, wound outwards and as large as asked."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_simulator.generation import mesh
from onemap_simulator.generation.mesh import Mesh

SOLIDS = {
    "box": mesh.box((1.0, 2.0, 3.0)),
    "span": mesh.box_between((-1, 0, 0), (1, 2, 0.5)),
    "soft box": mesh.rounded_box((1.0, 0.6, 0.4), (0, 0, 0), 0.1),
    "cylinder": mesh.cylinder(0.5, 2.0),
    "cone": mesh.cone((0.5, 0.2), 1.0),
    "lathe": mesh.lathe([(0.0, 0.0), (0.4, 0.3), (0.1, 1.0), (0.0, 1.1)]),
    "shell": mesh.lathe([(0.5, 0), (0.5, 1), (0.4, 1), (0.4, 0), (0.5, 0)], capped=False),
    "ellipsoid": mesh.ellipsoid((0.3, 0.5, 0.7)),
    "tube": mesh.tube([(0, 0, 0), (1, 0, 0.2), (1.5, 0, 1)], 0.1),
    "ring": mesh.torus(1.0, 0.1),
    "rod": mesh.rod((0, 0, 0), (0.3, 0.5, 1.0), 0.05),
    "prism": mesh.prism([(0, 0), (1, 0), (1, 1), (0, 1)], 0.2),
}


def volume(solid: Mesh) -> float:
    a, b, c = np.moveaxis(solid.vertices[solid.faces], 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_are_closed_and_wound_outwards(name: str) -> None:
    solid = SOLIDS[name]
    assert volume(solid) > 0
    points, merged = np.unique(solid.vertices.round(9), axis=0, return_inverse=True)
    faces = merged.reshape(-1)[solid.faces]
    edges = Counter((int(f[i]), int(f[(i + 1) % 3])) for f in faces for i in range(3))
    assert len(points) > 3
    assert all(edges[(b, a)] == count for (a, b), count in edges.items())


@pytest.mark.parametrize("name", SOLIDS)
def test_texture_coordinates_are_metres_on_the_surface(name: str) -> None:
    solid = SOLIDS[name]
    assert solid.uv.shape == (len(solid.faces), 3, 2)
    corners = solid.vertices[solid.faces]
    along = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    assert (np.linalg.norm(solid.uv[:, 1] - solid.uv[:, 0], axis=1) <= along + 1e-9).all()


@given(st.floats(0.1, 3), st.floats(0.1, 3), st.floats(0.1, 3), st.floats(0.001, 2))
def test_a_soft_box_keeps_its_size(w: float, d: float, h: float, radius: float) -> None:
    soft = mesh.rounded_box((w, d, h), (1.0, 2.0, 3.0), radius)
    lower, upper = soft.vertices.min(axis=0), soft.vertices.max(axis=0)
    np.testing.assert_allclose(upper - lower, (w, d, h), rtol=1e-6)
    assert lower[2] == pytest.approx(3.0)


def test_known_volumes() -> None:
    assert volume(mesh.box((1, 2, 3))) == pytest.approx(6.0)
    assert volume(mesh.cylinder(1.0, 2.0, segments=64)) == pytest.approx(2 * np.pi, rel=0.01)
    assert volume(mesh.ellipsoid((1, 2, 3), segments=64)) == pytest.approx(8 * np.pi, rel=0.01)


def test_moves_turns_and_stretches() -> None:
    point = mesh.box((2, 2, 2)).translated(3, 0, 0).rotated("z", 90)
    np.testing.assert_allclose(point.vertices.mean(axis=0), (0, 3, 1), atol=1e-12)
    assert volume(mesh.box((1, 1, 1)).scaled(1, 2, 3)) == pytest.approx(6.0)
    np.testing.assert_allclose(mesh.rotation("x", 90) @ (0, 1, 0), (0, 0, 1), atol=1e-12)
    np.testing.assert_allclose(mesh.rotation("y", 90) @ (0, 0, 1), (1, 0, 0), atol=1e-12)


def test_a_front_panel_faces_minus_y_with_its_image_upright() -> None:
    picture = mesh.front_panel(2.0, 1.0, (0, 0, 5.0))
    a, b, c = picture.vertices[picture.faces[0]]
    normal = np.cross(b - a, c - a)
    assert normal[1] < 0
    top_left = picture.uv[0, 0]
    np.testing.assert_allclose(picture.vertices[picture.faces[0, 0]], (-1, 0, 6))
    np.testing.assert_allclose(top_left, (0, 0))
