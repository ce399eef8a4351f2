"""What was tried is not offered again, until what is around it changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility
from onemap_planner.policy.ledger import MAX_RETURNS, Ledger, surroundings
from onemap_planner.world.map_view import MapView
from onemap_shared.messages import Occupancy
from tests.planner.drawn_maps import drawn_map

ROOM = drawn_map(*["." * 30] * 40)  # 4 x 3 m
PLACE = (1.5, 1.5)


def goal(x: float, y: float = 1.5, kind: GoalKind = GoalKind.FRONTIER) -> Goal:
    return Goal(kind, (x, y), (x, y), GoalUtility(0.2, 1.0), "")


def with_cells(cells: int, occupancy: Occupancy, x: int = 10) -> MapView:
    """The room with these cells of a row beside the place changed."""
    changed = ROOM.occupancy.copy()
    changed[x : x + 3].reshape(3, -1)[:, 8 : 8 + cells // 3] = occupancy
    return replace(ROOM, occupancy=changed)


def known(map_view: MapView = ROOM) -> Ledger:
    """A goal that was given up on this map."""
    ledger = Ledger()
    ledger.give_up(goal(*PLACE))
    ledger.offer_changed(map_view)
    return ledger


@pytest.mark.parametrize(
    ("before", "later", "offered"),
    [
        pytest.param(ROOM, ROOM, False, id="nothing has changed"),
        pytest.param(ROOM, with_cells(30, Occupancy.OCCUPIED), True, id="something came"),
        pytest.param(with_cells(30, Occupancy.OCCUPIED), ROOM, True, id="something has gone"),
        pytest.param(ROOM, with_cells(27, Occupancy.OCCUPIED), False, id="too little came"),
        pytest.param(ROOM, with_cells(30, Occupancy.OCCUPIED, x=30), False, id="too far away"),
        pytest.param(ROOM, with_cells(30, Occupancy.UNKNOWN), False, id="it is not known"),
        pytest.param(with_cells(30, Occupancy.UNKNOWN), ROOM, False, id="floor became known"),
    ],
)
def test_a_goal_is_offered_again_when_what_is_around_it_changes(
    before: MapView, later: MapView, offered: bool
) -> None:
    ledger = known(before)
    assert ledger.is_given_up(goal(*PLACE))
    ledger.offer_changed(later)
    assert ledger.is_given_up(goal(*PLACE)) != offered


def test_a_place_is_offered_again_a_few_times_only() -> None:
    views = (ROOM, with_cells(30, Occupancy.OCCUPIED))
    ledger, offered = Ledger(), 0
    for change in range(1, 9):
        there = goal(PLACE[0] + 0.05 * change)  # the border lies a little elsewhere each time
        ledger.give_up(there)
        for view in (views[change % 2], views[(change + 1) % 2]):
            ledger.offer_changed(view)
        offered += list(there.look_xy) not in ledger.looked_xy.tolist()
    assert offered == MAX_RETURNS


def test_the_next_object_begins_with_the_frontiers_that_were_seen() -> None:
    ledger = known()
    for kind in (GoalKind.REGION, GoalKind.DETECTION):
        ledger.give_up(goal(1.5, kind=kind))
    ledger.forget_looks()
    assert [each.kind for each in ledger.attempts] == [GoalKind.FRONTIER]


@pytest.mark.parametrize("xy", [(0.05, 0.05), (3.95, 2.95), (-0.5, 1.0), (9.0, 9.0)])
def test_beyond_the_view_nothing_is_known(xy: tuple[float, float]) -> None:
    patch = surroundings(ROOM, xy)
    assert patch.shape == (21, 21)
    centre = ROOM.grid.cells(np.asarray(xy))
    for i, j in ((10, 10), (0, 20), (20, 0), (3, 7)):
        cell = centre + (i - 10, j - 10)
        inside = bool(ROOM.grid.contains(cell))
        assert patch[i, j] == (Occupancy.FREE if inside else Occupancy.UNKNOWN)
