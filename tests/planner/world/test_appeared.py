"""What has just appeared where the floor was free."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_planner.world.appeared import LASTS_S, NOTHING, Appeared
from onemap_planner.world.map_view import MapView
from onemap_shared.geometry import F64
from tests.planner.drawn_maps import drawn_map

ROBOT = np.array([0.25, 0.25])
FREE = drawn_map(*["....."] * 5)
STANDS = drawn_map(".....", "...#.", "...#.", ".....", ".....")
PLACES = [[0.15, 0.35], [0.25, 0.35]]  # of what stands there, metres


def seen(*views: MapView, robot_xy: F64 = ROBOT, period_s: float = 0.25) -> Appeared:
    """What has appeared after these views, one a period."""
    appeared = NOTHING
    for number, view in enumerate(views):
        appeared = appeared.with_view(view, robot_xy, number * period_s)
    return appeared


def test_what_stands_where_the_floor_was_free_has_appeared() -> None:
    assert seen(FREE, STANDS).xy == pytest.approx(np.array(PLACES))
    assert len(seen(STANDS).xy) == 0  # a wall that comes into view
    assert len(seen(drawn_map(*["     "] * 5), STANDS).xy) == 0
    assert len(seen(drawn_map(*["aaaaa"] * 5), STANDS).xy) == 0  # no camera saw the floor there


def test_it_counts_until_it_has_stood_for_a_while() -> None:
    views = (FREE, *[STANDS] * 6)
    counts = [len(seen(*views[: n + 1]).xy) for n in range(len(views))]
    lasting = round(LASTS_S / 0.25) + 1
    assert counts == [0, *[2] * lasting, *[0] * (len(views) - 1 - lasting)]


def test_who_walks_on_is_no_longer_where_they_were() -> None:
    onwards = drawn_map(".....", ".....", ".....", "...#.", "...#.")
    assert seen(FREE, STANDS, onwards).xy[:, 0] == pytest.approx([0.35, 0.45])
