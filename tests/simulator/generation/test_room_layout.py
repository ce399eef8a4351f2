"""The site refuses what would meet something or cut a room off."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.generation.floor_plan import FloorPlan, Opening, Space, sample_floor_plan
from onemap_simulator.generation.mesh import box
from onemap_simulator.generation.model import Material, Model, assemble, support_surface
from onemap_simulator.generation.placement import Placer, place_relative
from onemap_simulator.generation.room_layout import RoomLayout, place
from onemap_simulator.generation.sampler import Sampler
from onemap_simulator.generation.style import HELD_OUT, TRAINING

GREY = Material(np.full((2, 2, 3), 128, np.uint8))
PLAN = FloorPlan(
    spaces=(Space("hallway", (0, 0, 4, 2)), Space("bedroom", (0, 2, 4, 6))),
    doors=(Opening(0, 2.0, 1.5, 2.5, 0.0, 2.05, (0, 1)),),
    entrance=Opening(1, 0.0, 0.5, 1.5, 0.0, 2.05, (0,)),
    windows=(Opening(0, 6.0, 1.0, 2.5, 0.9, 2.1, (1,)),),
    height_m=2.5,
)


def block(width: float, depth: float, height: float) -> Model:
    return assemble(
        "box",
        (GREY, [box((width, depth, height))]),
        support_surfaces=(support_surface(width, depth, height),),
    )


def make_placer(layout: RoomLayout, space: int = 1) -> Placer:
    return Placer(layout, Sampler(np.random.default_rng(0), TRAINING), space)


def test_two_things_do_not_overlap() -> None:
    layout = RoomLayout(PLAN)
    assert layout.add([place(block(1, 1, 1), (0.6, 5.0, 0), 0, 1)])
    assert not layout.add([place(block(1, 1, 1), (1.2, 5.0, 0), 0, 1)])
    assert layout.add([place(block(0.3, 0.3, 0.3), (0.6, 5.0, 1.0), 0, 1)])


def test_doors_stay_open() -> None:
    layout = RoomLayout(PLAN)
    assert not layout.add([place(block(0.3, 0.3, 0.5), (2.0, 2.5, 0), 0, 1)])
    assert not layout.add([place(block(0.3, 0.3, 0.5), (0.4, 1.0, 0), 0, 0)])


def test_a_barricade_is_refused() -> None:
    layout = RoomLayout(PLAN)
    assert not layout.add([place(block(3.85, 0.3, 1), (2.0, 3.5, 0), 0, 1)])
    assert layout.add([place(block(2.0, 0.3, 1), (1.1, 3.5, 0), 0, 1)])


def test_what_is_too_far_from_any_path_is_refused() -> None:
    layout = RoomLayout(PLAN)
    deep = [place(block(3.8, 2.2, 0.5), (2.0, 4.8, 0), 0, 1)]
    assert layout.add(deep)
    hung = place(block(0.3, 0.1, 0.3), (2.9, 5.85, 1.2), 0, 1)
    assert not layout.add([hung])


def test_outside_the_room_is_refused() -> None:
    layout = RoomLayout(PLAN)
    assert not layout.add([place(block(0.5, 0.5, 0.5), (0.1, 4.0, 0), 0, 1)])
    assert not layout.add([place(block(0.5, 0.5, 2.7), (1.0, 4.0, 0), 0, 1)])


def test_tall_things_avoid_windows() -> None:
    layout = RoomLayout(PLAN)
    assert not layout.add([place(block(0.5, 0.4, 1.8), (1.5, 5.7, 0), 0, 1)])
    assert layout.add([place(block(0.5, 0.4, 0.8), (1.5, 5.7, 0), 0, 1)])


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
    centres = np.array([item.position_m[:2] for item in row])
    np.testing.assert_allclose(np.linalg.norm(np.diff(centres, axis=0), axis=1), 0.6)
    assert make_placer(RoomLayout(PLAN)).in_row([block(0.6, 0.6, 0.9) for _ in range(9)]) is None


def test_things_on_top_stand_on_their_support() -> None:
    layout = RoomLayout(PLAN)
    room = make_placer(layout)
    support = room.against_wall(block(1.0, 0.5, 0.8))
    assert support is not None
    cup = room.on_top(block(0.1, 0.1, 0.1), support)
    assert cup is not None
    assert cup.box[0, 2] == pytest.approx(0.8)
    assert room.on_top(block(2.0, 2.0, 0.1), support) is None
    assert (
        room.on_top(block(0.1, 0.1, 0.1), place(Model("x", cup.model.parts), cup.position_m, 0, 1))
        is None
    )


def test_beside_uses_the_local_frame() -> None:
    support = place(block(1, 1, 1), (1.0, 1.0, 0.0), 90.0, 1)
    item = place_relative(support, block(0.2, 0.2, 0.2), np.array([0.0, 1.0, 0.0]), 0.0)
    np.testing.assert_allclose(item.position_m, (0.0, 1.0, 0.0), atol=1e-12)
    assert item.yaw_deg == 90.0


@pytest.mark.parametrize("seed", range(12))
def test_plans_are_sound(seed: int) -> None:
    plan = sample_floor_plan(
        Sampler(np.random.default_rng(seed), HELD_OUT if seed % 2 else TRAINING)
    )
    assert 5 <= len(plan.spaces) <= 7
    assert {door.spaces[1] for door in plan.doors if door.spaces[0] == 0} == set(
        range(1, len(plan.spaces))
    )
    for door in (*plan.doors, plan.entrance):
        assert door.width >= 0.9
        assert door.top >= 2.0
        for index in door.spaces:
            x0, y0, x1, y1 = plan.spaces[index].rect
            x, y = door.centre
            assert x0 - 1e-6 <= x <= x1 + 1e-6
            assert y0 - 1e-6 <= y <= y1 + 1e-6
    for window in plan.windows:
        assert 0 < window.sill < window.top < plan.height_m
