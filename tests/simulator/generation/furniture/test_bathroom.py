from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.generation.furniture.bathroom import (
    bathroom_sink,
    bathtub,
    shower,
    toilet,
    towel,
    washing_machine,
)
from tests.simulator.generation.furniture.draws import backs, draws, extents


def test_a_towel_hangs_on_the_wall() -> None:
    np.testing.assert_allclose(backs(draws(towel)), 0.0, atol=1e-9)


def test_a_bathtub_is_long_enough_to_lie_in() -> None:
    size = extents(draws(bathtub))
    assert (size[:, 0] > 1.5).all()
    assert (size[:, 0] > 1.9 * size[:, 1]).all()


def test_fixtures_have_the_heights_that_people_use() -> None:
    assert (np.abs(extents(draws(shower))[:, 2] - 2.05) < 0.1).all()
    assert (extents(draws(toilet))[:, 2] < 1.0).all()
    assert all(0.8 < model.upper[2] < 1.25 for model in draws(bathroom_sink))


def test_a_washing_machine_supports_objects_on_its_top() -> None:
    for model in draws(washing_machine):
        (top,) = model.support_surfaces
        assert top.z == pytest.approx(model.upper[2])
