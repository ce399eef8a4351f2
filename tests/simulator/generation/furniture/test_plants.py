from __future__ import annotations

import numpy as np

from onemap_simulator.generation.furniture.plants import floor_plant, small_plant, vase
from tests.simulator.generation.furniture.draws import draws, extents


def test_a_plant_for_the_floor_is_taller_than_one_for_a_table() -> None:
    assert extents(draws(floor_plant))[:, 2].min() > extents(draws(small_plant))[:, 2].max()


def test_leaves_grow_out_of_the_pot() -> None:
    for model in draws(floor_plant):
        pot = model.parts[0].mesh.vertices
        assert pot[:, 2].min() == 0.0
        assert model.upper[2] > pot[:, 2].max() + 0.2


def test_some_vases_hold_flowers() -> None:
    counts = [len(model.parts) for model in draws(vase)]
    assert min(counts) == 1 < max(counts)
    assert (np.diff(np.unique(counts)) > 0).all()
