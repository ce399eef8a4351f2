from __future__ import annotations

import numpy as np

from onemap_simulator.generation.furniture.containers import (
    basket,
    cardboard_box,
    suitcase,
    trash_can,
)
from tests.simulator.generation.furniture.draws import draws, extents


def test_containers_stand_on_the_floor() -> None:
    for factory in (basket, cardboard_box, suitcase, trash_can):
        np.testing.assert_allclose([m.lower[2] for m in draws(factory)], 0.0, atol=1e-3)


def test_a_suitcase_is_upright_and_a_carton_is_not() -> None:
    suitcases, cartons = extents(draws(suitcase)), extents(draws(cardboard_box))
    assert (suitcases[:, 2] > 1.5 * suitcases[:, :2].max(axis=1)).all()
    assert (cartons[:, 2] < 1.2 * cartons[:, :2].max(axis=1)).all()


def test_some_cartons_are_open() -> None:
    assert len({len(model.parts) for model in draws(cardboard_box)}) > 1
