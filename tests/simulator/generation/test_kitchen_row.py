from __future__ import annotations

import numpy as np

from onemap_simulator.generation.kitchen_row import kitchen_row
from onemap_simulator.generation.placement import Placer
from onemap_simulator.generation.room_layout import RoomLayout
from onemap_simulator.generation.sampler import Sampler
from onemap_simulator.generation.style import TRAINING
from tests.simulator.generation.layouts import room_of


def test_units_stand_side_by_side_against_one_wall_with_cabinets_above() -> None:
    layout = RoomLayout(room_of("kitchen"))
    sampler = Sampler(np.random.default_rng(1), TRAINING)
    kitchen_row(Placer(layout, sampler, 1))
    units = [
        item
        for item in layout.placed
        if item.model.category in ("sink", "oven", "dishwasher", "refrigerator", "kitchen cabinet")
    ]
    base = [item for item in units if item.box[0, 2] < 0.5]
    above = [item for item in units if item.box[0, 2] > 1.0]
    assert len(base) == 6
    assert len({item.yaw_deg for item in base}) == 1
    along = 0 if base[0].yaw_deg in (0.0, 180.0) else 1
    edges = np.array(sorted(item.box[:, along].tolist() for item in base))
    np.testing.assert_allclose(edges[1:, 0], edges[:-1, 1], atol=1e-6)
    assert above
    for cabinet in above:
        assert cabinet.model.category == "kitchen cabinet"
        assert any(
            abs(cabinet.box[:, along].mean() - unit.box[:, along].mean()) < 0.01 for unit in base
        )
