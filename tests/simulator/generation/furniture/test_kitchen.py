from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.generation.furniture.kitchen import (
    COUNTER_M,
    DEPTH_M,
    kitchen_cabinet,
    kitchen_look,
    kitchen_sink,
    wall_cabinet,
)
from tests.simulator.generation.furniture.draws import sampler


@pytest.mark.parametrize("seed", range(6))
def test_units_have_the_width_asked_for_and_one_worktop_height(seed: int) -> None:
    look = kitchen_look(sampler(seed))
    cabinet = kitchen_cabinet(sampler(seed), 0.7, look)
    sink = kitchen_sink(sampler(seed), 0.7, look)
    for model in (cabinet, sink):
        assert np.ptp([model.lower[0], model.upper[0]]) == pytest.approx(0.7, abs=0.01)
        assert model.upper[1] == pytest.approx(DEPTH_M / 2, abs=0.011)
    assert cabinet.upper[2] == pytest.approx(COUNTER_M)
    assert [surface.z for surface in cabinet.support_surfaces] == [COUNTER_M]
    assert sink.upper[2] > COUNTER_M  # the tap


def test_all_units_of_a_kitchen_share_their_materials() -> None:
    look = kitchen_look(sampler(0))
    for model in (kitchen_cabinet(sampler(1), 0.6, look), wall_cabinet(sampler(2), 0.6, look)):
        assert {part.material for part in model.parts} <= set(look)


def test_a_wall_cabinet_is_shallower_than_a_base_cabinet() -> None:
    model = wall_cabinet(sampler(0), 0.6, kitchen_look(sampler(0)))
    assert np.ptp([model.lower[1], model.upper[1]]) < 0.7 * DEPTH_M
