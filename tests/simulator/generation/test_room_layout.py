"""A layout refuses models that would overlap another or cut a room off."""

from __future__ import annotations

from onemap_simulator.generation.room_layout import RoomLayout, place
from tests.simulator.generation.layouts import PLAN, block


def test_two_models_do_not_overlap() -> None:
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


def test_tall_models_avoid_windows() -> None:
    layout = RoomLayout(PLAN)
    assert not layout.add([place(block(0.5, 0.4, 1.8), (1.5, 5.7, 0), 0, 1)])
    assert layout.add([place(block(0.5, 0.4, 0.8), (1.5, 5.7, 0), 0, 1)])
