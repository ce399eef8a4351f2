from __future__ import annotations

from onemap_simulator.generation.furniture.tableware import book, bottle, bowl, cup
from tests.simulator.generation.furniture.draws import draws, extents


def test_a_bottle_is_tall_and_a_bowl_is_wide() -> None:
    bottles, bowls = extents(draws(bottle)), extents(draws(bowl))
    assert (bottles[:, 2] > 2 * bottles[:, 0]).all()
    assert (bowls[:, 0] > 2 * bowls[:, 2]).all()


def test_the_handle_of_a_cup_sticks_out_on_one_side() -> None:
    for model in draws(cup):
        mug, handle = (part.mesh.vertices for part in model.parts[:2])
        assert handle[:, 0].max() > mug[:, 0].max()


def test_books_are_piled_without_gaps() -> None:
    for model in draws(book):
        covers = sorted(
            (part.mesh.vertices[:, 2].min(), part.mesh.vertices[:, 2].max())
            for part in model.parts
            if part.mesh.vertices[:, 2].max() - part.mesh.vertices[:, 2].min() > 0.02
        )
        reached = 0.0
        for low, high in covers:
            assert low <= reached + 0.007
            reached = max(reached, high)
        assert reached == model.upper[2]
