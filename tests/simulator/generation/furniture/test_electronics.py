from __future__ import annotations

import numpy as np

from onemap_simulator.generation.furniture.electronics import (
    floor_lamp,
    laptop,
    radiator,
    standing_fan,
    table_fan,
    table_lamp,
    television,
)
from tests.simulator.generation.furniture.draws import draws, extents


def test_a_television_is_wide_and_on_a_foot_only_if_it_stands() -> None:
    standing = extents(draws(lambda s: television(s, hanging=False)))
    hanging = extents(draws(lambda s: television(s, hanging=True)))
    for size in (standing, hanging):
        assert (size[:, 0] > 1.3 * size[:, 2]).all()
    assert (standing[:, 1] > hanging[:, 1]).all()
    assert (hanging[:, 1] < 0.12).all()


def test_what_stands_on_the_floor_is_taller_than_its_twin_for_furniture() -> None:
    for large, small in ((floor_lamp, table_lamp), (standing_fan, table_fan)):
        assert extents(draws(large))[:, 2].min() > 1.8 * extents(draws(small))[:, 2].max()


def test_the_screen_of_an_open_laptop_rises_behind_its_keyboard() -> None:
    for model in draws(laptop):
        points = np.concatenate([part.mesh.vertices for part in model.parts])
        assert points[points[:, 2].argmax(), 1] > points[:, 1].mean()


def test_a_radiator_is_flat() -> None:
    size = extents(draws(radiator))
    assert (size[:, 1] < 0.2).all()
    assert (size[:, 0] > 3 * size[:, 1]).all()
