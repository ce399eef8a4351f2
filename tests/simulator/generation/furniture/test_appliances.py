from __future__ import annotations

import numpy as np

from onemap_simulator.generation.furniture.appliances import (
    dishwasher,
    kettle,
    microwave,
    oven,
    refrigerator,
    toaster,
)
from onemap_simulator.generation.furniture.kitchen import COUNTER_M, DEPTH_M
from tests.simulator.generation.furniture.draws import draws, extents


def test_units_of_the_row_are_as_deep_as_the_cabinets() -> None:
    for models in (draws(oven), draws(lambda s: dishwasher(s, s.wood()))):
        np.testing.assert_allclose(extents(models)[:, 1], DEPTH_M, atol=0.07)
        np.testing.assert_allclose([model.upper[1] for model in models], DEPTH_M / 2, atol=0.02)


def test_the_top_of_a_dishwasher_continues_the_worktop() -> None:
    for model in draws(lambda s: dishwasher(s, s.wood())):
        assert [surface.z for surface in model.support_surfaces] == [COUNTER_M]


def test_a_refrigerator_is_the_tallest_and_small_appliances_fit_on_a_worktop() -> None:
    assert (extents(draws(refrigerator))[:, 2] > 1.5).all()
    for factory in (kettle, microwave, toaster):
        assert (extents(draws(factory))[:, 1] < DEPTH_M - 0.08).all()
