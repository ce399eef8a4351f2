"""The unknown area in view: rays end at walls, and what lies outside the grid is unknown."""

import numpy as np
import pytest

from onemap_planner.world.frontiers import area_in_view
from onemap_shared.messages import Occupancy
from tests.planner.drawn_maps import drawn_map


def area_m2(rows: tuple[str, ...], cell: tuple[int, int], range_m: float = 1.0) -> float:
    map_view = drawn_map(*rows, scale=5)
    unknown = map_view.occupancy == Occupancy.UNKNOWN
    (area,) = area_in_view(map_view, unknown, np.array([cell]), range_m)
    return float(area)


def test_all_around_an_open_place_is_the_circle() -> None:
    assert area_m2((" ",), (2, 2)) == pytest.approx(np.pi, rel=0.12)


def test_known_floor_counts_nothing() -> None:
    assert area_m2(("." * 7,) * 7, (17, 17)) == 0.0


def test_a_wall_hides_what_lies_behind() -> None:
    open_m2 = area_m2(("." * 5, "." * 5, " " * 5), (5, 12))
    behind_a_wall = area_m2(("." * 5, "." * 5, "#" * 5, " " * 5, " " * 5), (5, 12))
    assert open_m2 > 0.3
    assert behind_a_wall < open_m2


def test_a_closed_room_shows_nothing_however_large_the_unknown_around_it() -> None:
    assert area_m2(("#####", "#...#", "#...#", "#####"), (8, 12), range_m=5.0) == 0.0


def test_a_pocket_shows_less_than_a_door() -> None:
    door = ("######    ", "#.....    ", "######    ")
    pocket = ("#######", "#.... #", "#######")
    assert area_m2(pocket, (7, 20), 3.0) < 0.5 < area_m2(door, (7, 25), 3.0)
