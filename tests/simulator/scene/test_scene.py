"""A scene checks itself when it is made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.scene.scene import Scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    return generate_apartment(901)


def test_arrays_that_do_not_belong_together_are_refused(scene: Scene) -> None:
    with pytest.raises(ValueError, match="face_texture has shape"):
        replace(scene, face_texture=scene.face_texture[1:])


def test_a_scene_needs_triangles(scene: Scene) -> None:
    empty = {
        name: getattr(scene, name)[:0]
        for name in ("faces", "face_object", "face_texture", "face_uv")
    }
    with pytest.raises(ValueError, match="has no triangles"):
        replace(scene, **empty)


def test_vertices_must_be_finite(scene: Scene) -> None:
    broken = scene.vertices.copy()
    broken[3] = np.nan
    with pytest.raises(ValueError, match="NaN or infinite"):
        replace(scene, vertices=broken)
