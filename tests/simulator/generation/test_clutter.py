from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.generation.clutter import (
    add_missing,
    hang_curtains,
    hang_on_walls,
    place_on,
)
from onemap_simulator.generation.furniture.tableware import cup
from onemap_simulator.generation.furniture.wall_decor import picture
from onemap_simulator.generation.room_layout import RoomLayout
from onemap_simulator.generation.sampler import Sampler
from onemap_simulator.generation.style import TRAINING
from tests.simulator.generation.layouts import PLAN, block, make_placer


def test_candidates_of_probability_one_are_placed_on_a_support() -> None:
    layout = RoomLayout(PLAN)
    placer = make_placer(layout)
    support = placer.against_wall(block(1.0, 0.5, 0.8))
    assert support is not None
    place_on(placer, [support], [(1.0, cup), (0.0, picture)])
    assert [item.model.category for item in layout.placed] == ["box", "cup"]
    assert layout.placed[1].box[0, 2] == pytest.approx(0.8)


def test_without_a_support_nothing_is_placed_or_drawn() -> None:
    layout = RoomLayout(PLAN)
    placer = make_placer(layout)
    place_on(placer, [], [(1.0, cup)])
    assert layout.placed == []
    assert placer.sampler.rng.random() == np.random.default_rng(0).random()


def test_pictures_hang_at_eye_height_on_a_wall() -> None:
    layout = RoomLayout(PLAN)
    hang_on_walls(make_placer(layout), [(1.0, picture)])
    (item,) = layout.placed
    assert 0.7 <= item.box[0, 2] < 1.5 < item.box[1, 2] + 0.7
    x0, y0, x1, y1 = PLAN.spaces[1].inner
    gaps = (item.box[0, :2] - (x0, y0), (x1, y1) - item.box[1, :2])
    assert np.min(gaps) == pytest.approx(0.02, abs=1e-6)


def test_missing_categories_are_added_once_in_their_rooms() -> None:
    layout = RoomLayout(PLAN)
    sampler = Sampler(np.random.default_rng(0), TRAINING)
    add_missing(layout, sampler)
    categories = [item.model.category for item in layout.placed]
    assert len(categories) == len(set(categories)) > 5
    rooms = {item.model.category: PLAN.spaces[item.space].kind for item in layout.placed}
    assert rooms.get("nightstand", "bedroom") == "bedroom"
    assert "refrigerator" not in rooms or rooms["refrigerator"] == "hallway"


def test_curtains_hang_in_pairs_beside_the_window() -> None:
    hung = 0
    for seed in range(8):
        layout = RoomLayout(PLAN)
        hang_curtains(layout, Sampler(np.random.default_rng(seed), TRAINING))
        if not layout.placed:
            continue
        hung += 1
        left, right = sorted(layout.placed[-2:], key=lambda item: item.box[0, 0])
        window = PLAN.windows[0]
        middle = (left.box[0, 0] + right.box[1, 0]) / 2
        assert middle == pytest.approx(window.centre[0], abs=0.05)
        assert left.box[1, 0] < window.centre[0] < right.box[0, 0]
    assert hung
