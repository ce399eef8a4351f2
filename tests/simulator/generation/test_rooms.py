from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.generation.placement import Placer
from onemap_simulator.generation.room_layout import RoomLayout
from onemap_simulator.generation.rooms import furnish
from onemap_simulator.generation.sampler import Sampler
from onemap_simulator.generation.style import TRAINING
from tests.simulator.generation.layouts import room_of

# Categories that a large room of each kind has in almost every draw.
EXPECTED = {
    "living room": {"sofa", "television"},
    "kitchen": {"sink", "oven", "refrigerator"},
    "bathroom": {"toilet", "sink"},
    "bedroom": {"bed", "wardrobe"},
    "study": {"desk", "bookcase"},
    "dining room": {"table", "chair"},
    "hallway": set(),
}


@pytest.mark.parametrize("kind", EXPECTED)
def test_a_room_gets_the_furniture_of_its_kind_and_stays_passable(kind: str) -> None:
    complete = 0
    for seed in range(4):
        layout = RoomLayout(room_of(kind))
        furnish(Placer(layout, Sampler(np.random.default_rng(seed), TRAINING), 1))
        assert all(item.space == 1 for item in layout.placed)
        assert all(item.box[1, 2] <= layout.plan.height_m for item in layout.placed)
        complete += EXPECTED[kind] <= {item.model.category for item in layout.placed}
        x, y = layout.grid.centres(np.argwhere(layout.reachable_cells())).T
        assert (y > 2.5).any()
        assert (y < 1.5).any()
        assert len(x)
    assert complete >= 3
