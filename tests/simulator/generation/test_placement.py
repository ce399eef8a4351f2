from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.generation.model import Model
from onemap_simulator.generation.placement import place_relative
from onemap_simulator.generation.room_layout import RoomLayout, place
from tests.simulator.generation.layouts import PLAN, block, make_placer


@pytest.mark.parametrize("side", ["west", "south", "east", "north"])
def test_at_wall_puts_the_back_to_the_wall(side: str) -> None:
    item = make_placer(RoomLayout(PLAN)).at_wall(block(1.0, 0.4, 1.0), side, 0.5, 0.0)
    assert item is not None
    x0, y0, x1, y1 = PLAN.spaces[1].inner
    gap = {
        "west": item.box[0, 0] - x0,
        "south": item.box[0, 1] - y0,
        "east": x1 - item.box[1, 0],
        "north": y1 - item.box[1, 1],
    }[side]
    assert gap == pytest.approx(0.02)
    extent = item.box[1] - item.box[0]
    assert extent[0 if side in ("west", "east") else 1] == pytest.approx(0.4)


def test_a_row_touches_without_overlap_and_too_long_a_row_is_refused() -> None:
    row = make_placer(RoomLayout(PLAN)).in_row([block(0.6, 0.6, 0.9) for _ in range(3)])
    assert row is not None
    centres = np.array([model.position_m[:2] for model in row])
    np.testing.assert_allclose(np.linalg.norm(np.diff(centres, axis=0), axis=1), 0.6)
    assert make_placer(RoomLayout(PLAN)).in_row([block(0.6, 0.6, 0.9) for _ in range(9)]) is None


def test_models_on_top_stand_on_their_support() -> None:
    layout = RoomLayout(PLAN)
    placer = make_placer(layout)
    support = placer.against_wall(block(1.0, 0.5, 0.8))
    assert support is not None
    cup = placer.on_top(block(0.1, 0.1, 0.1), support)
    assert cup is not None
    assert cup.box[0, 2] == pytest.approx(0.8)
    assert placer.on_top(block(2.0, 2.0, 0.1), support) is None
    assert (
        placer.on_top(
            block(0.1, 0.1, 0.1), place(Model("x", cup.model.parts), cup.position_m, 0, 1)
        )
        is None
    )


def test_a_relative_placement_uses_the_local_frame() -> None:
    support = place(block(1, 1, 1), (1.0, 1.0, 0.0), 90.0, 1)
    item = place_relative(support, block(0.2, 0.2, 0.2), np.array([0.0, 1.0, 0.0]), 0.0)
    np.testing.assert_allclose(item.position_m, (0.0, 1.0, 0.0), atol=1e-12)
    assert item.yaw_deg == 90.0


def test_companions_keep_their_place_around_the_model_in_the_middle() -> None:
    offset = np.array([0.0, -0.6, 0.0])
    group = make_placer(RoomLayout(PLAN)).in_middle(
        block(0.8, 0.8, 0.7), [(block(0.3, 0.3, 0.8), offset, 180.0)]
    )
    assert group is not None
    table, chair = group
    assert chair.yaw_deg == table.yaw_deg + 180.0
    np.testing.assert_allclose(np.linalg.norm(np.subtract(chair.position_m, table.position_m)), 0.6)


def test_a_corner_touches_two_walls() -> None:
    item = make_placer(RoomLayout(PLAN)).in_corner(block(0.5, 0.4, 1.0))
    assert item is not None
    x0, y0, x1, y1 = PLAN.spaces[1].inner
    gaps = [item.box[0, 0] - x0, item.box[0, 1] - y0, x1 - item.box[1, 0], y1 - item.box[1, 1]]
    assert sum(gap == pytest.approx(0.02) for gap in gaps) == 2


def test_a_model_that_fits_nowhere_is_not_placed() -> None:
    layout = RoomLayout(PLAN)
    placer = make_placer(layout)
    assert placer.against_wall(block(9.0, 0.4, 1.0)) is None
    assert placer.in_corner(block(9.0, 0.4, 1.0)) is None
    assert placer.on_floor(block(9.0, 9.0, 1.0)) is None
    assert placer.in_middle(block(3.9, 3.9, 1.0), []) is None
    assert layout.placed == []
