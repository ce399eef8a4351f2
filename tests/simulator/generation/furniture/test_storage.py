from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.generation.furniture.storage import (
    bookcase,
    dresser,
    nightstand,
    shelf,
    wardrobe,
)
from tests.simulator.generation.furniture.draws import draws, extents


def test_wardrobes_are_the_tallest_and_nightstands_the_lowest() -> None:
    heights = [extents(draws(factory))[:, 2] for factory in (wardrobe, dresser, nightstand)]
    assert heights[0].min() > heights[1].max() > heights[1].min() > heights[2].max()


def test_chests_of_drawers_support_objects_on_their_top() -> None:
    for model in (*draws(dresser), *draws(nightstand)):
        (top,) = model.support_surfaces
        assert top.z == pytest.approx(model.upper[2])


def test_every_board_of_a_shelf_supports_objects_at_a_height_of_its_own() -> None:
    for model in draws(shelf):
        heights = [surface.z for surface in model.support_surfaces]
        assert len(set(heights)) == len(heights) >= 1
        surfaces = np.unique(np.concatenate([p.mesh.vertices[:, 2] for p in model.parts]).round(6))
        assert set(np.round(heights, 6)) <= set(surfaces)


def test_books_stand_inside_their_bookcase() -> None:
    for model in draws(bookcase):
        case = model.parts[0].mesh
        for part in model.parts:
            assert part.mesh.vertices[:, 2].max() <= model.upper[2]
            assert part.mesh.vertices[:, 0].min() >= model.lower[0]
        assert case.vertices[:, 2].min() >= 0.0
