"""Occupied cells against dense sampling of the triangles."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_shared.geometry import F64
from onemap_shared.grid import GridSpec
from onemap_simulator.generation.mesh import box
from onemap_simulator.scene.occupancy_raster import occupied_cells, rasterise
from onemap_simulator.scene.scene import Scene, SceneObject
from tests.reference.occupancy_raster import touched_cells

CELL_SIZE_M = 0.1


def scene_of(vertices: F64, faces: np.ndarray) -> Scene:
    count = len(faces)
    return Scene(
        name="test",
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        face_object=np.zeros(count, np.int32),
        face_texture=np.zeros(count, np.int32),
        face_uv=np.zeros((count, 3, 2), np.float32),
        textures=(np.zeros((1, 1, 3), np.uint8),),
        objects=(SceneObject("box"),),
        lights=(),
        ambient=(1.0, 1.0, 1.0),
        rooms=(),
        start=(0.0, 0.0, 0.0),
    )


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), size=st.floats(0.02, 1.5))
def test_every_sampled_point_lies_in_an_occupied_cell(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    triangles = rng.uniform(-1, 1, (3, 1, 3)) + rng.uniform(-size, size, (3, 3, 3))
    spec = GridSpec.covering(CELL_SIZE_M, (-3.0, -3.0), (3.0, 3.0))
    z_range = (-0.4, 0.5)
    occupied = rasterise(triangles, spec, z_range)
    have = {
        (int(x) + spec.origin_cell[0], int(y) + spec.origin_cell[1])
        for x, y in np.argwhere(occupied)
    }
    sampled = touched_cells(triangles, CELL_SIZE_M, z_range, 0.04)
    assert sampled <= have
    # Tight: nothing is set more than a cell away from where a sample is.
    for x, y in have:
        near = {(x + i, y + j) for i in (-1, 0, 1) for j in (-1, 0, 1)}
        assert near & sampled or not sampled


def test_a_box_occupies_its_footprint_only_at_its_heights() -> None:
    block = box((0.35, 0.15, 0.5), (0.525, 0.275, 0.2))
    scene = scene_of(block.vertices, block.faces)
    spec, occupied = occupied_cells(scene, CELL_SIZE_M, 0.3, 0.6)
    cells = {tuple(spec.centres(cell).round(2)) for cell in np.argwhere(occupied)}
    edge = {(x, y) for x in (0.35, 0.45, 0.55, 0.65) for y in (0.25, 0.35)}
    assert cells == edge
    assert not occupied_cells(scene, CELL_SIZE_M, 0.8, 1.5)[1].any()
    assert not occupied_cells(scene, CELL_SIZE_M, -1.0, 0.1)[1].any()


def test_negative_coordinates_round_down() -> None:
    block = box((0.08, 0.08, 1.0), (-0.05, -0.05, 0.0))
    spec, occupied = occupied_cells(scene_of(block.vertices, block.faces), CELL_SIZE_M, 0.1, 0.9)
    assert spec.origin_cell == (-1, -1)
    assert np.argwhere(occupied).tolist() == [[0, 0]]
