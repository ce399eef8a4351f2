"""N keeps the robot's distance, and lets it out of where it should not stand."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_planner.world.costmap import build_terrain
from onemap_planner.world.map_view import belief_around
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Occupancy, SearchView
from tests.planner.drawn_maps import NO_PLACES, POINT_ROBOT, RULES, as_view, drawn, terrain_of
from tests.reference.planning import clearances

OPEN = drawn(*["." * 5] * 5, scale=5)


@settings(deadline=None, max_examples=30)
@given(arrays(np.uint8, (9, 8), elements=st.sampled_from([0, 1, 2])))
def test_navigable_is_free_with_room_for_the_robot(occupancy: np.ndarray) -> None:
    belief = replace(drawn(*["." * 8] * 9), occupancy=occupancy)
    rules = replace(POINT_ROBOT, radius_m=0.1, margin_m=0.0, escape_below_m2=0.0)
    terrain = terrain_of(belief, (0.05, 0.05), rules)
    away = clearances(occupancy == Occupancy.OCCUPIED, 0.1)
    free = occupancy == Occupancy.FREE
    for under_the_robot in ((0, 0), (0, 1), (1, 0)):
        free[under_the_robot] |= occupancy[under_the_robot] != Occupancy.OCCUPIED
    expected = free & (away >= 0.1)
    assert (terrain.navigable == expected).all()
    assert ((terrain.cost >= 1.0) == expected).all()
    np.testing.assert_allclose(terrain.clearance_m, away, rtol=1e-6)


def test_unknown_is_not_free_but_the_driven_floor_is() -> None:
    belief = drawn(*["     "] * 5, scale=4)
    trail = np.array([[0.55, 1.0], [1.0, 1.0]])
    terrain = build_terrain(
        belief,
        robot_xy=np.array([1.45, 1.0]),
        trail_xy=trail,
        blocked_xy=NO_PLACES,
        rules=RULES.terrain,
    )
    assert terrain.free[5, 10]
    assert terrain.free[14, 10]
    assert not terrain.free[5, 15]
    assert not terrain.navigable[5, 15]


def test_costs_rise_towards_obstacles() -> None:
    belief = drawn("#####", *["....."] * 4, scale=5)
    cost = terrain_of(belief, (1.5, 1.2), RULES.terrain).cost[:, 12]
    allowed = cost[cost > 0]
    assert (np.diff(allowed) <= 0).all()
    assert allowed[0] > 2.0
    assert allowed[-1] == 1.0


def test_a_robot_in_inflated_space_may_leave_it() -> None:
    belief = drawn("#####", *["....."] * 4, scale=5)
    terrain = terrain_of(belief, (0.55, 1.2), RULES.terrain)
    cell = (5, 12)
    assert not terrain.navigable[cell]
    assert terrain.passable[cell]
    outward = terrain.cost[5:9, 12]
    assert (np.diff(outward) < 0).all()  # cheaper the farther from the wall
    assert not terrain.passable[0, 12]


def test_a_robot_on_unseen_floor_may_walk_to_seen_floor() -> None:
    hole = np.array(OPEN.occupancy)
    hole[6:19, 6:19] = Occupancy.UNKNOWN
    terrain = terrain_of(replace(OPEN, occupancy=hole), (1.25, 1.25), RULES.terrain)
    assert terrain.passable[8, 12]
    assert not terrain.navigable[8, 12]


def test_a_block_takes_its_surroundings_out_of_the_way() -> None:
    blocked = build_terrain(
        OPEN,
        robot_xy=np.array([0.6, 0.6]),
        trail_xy=NO_PLACES,
        blocked_xy=np.array([[1.85, 1.85], [99.0, 99.0]]),
        rules=RULES.terrain,
    )
    assert blocked.occupied[18, 18]
    assert not blocked.navigable[17, 17]
    assert blocked.navigable[12, 12]


def test_the_window_holds_what_is_known_and_the_robot() -> None:
    view = as_view(drawn("          ", "   ..#    ", "          "))
    belief = belief_around(view, np.array([0.95, -0.35]))
    assert belief.grid.contains(belief.grid.cells(np.array([0.95, -0.35])))
    cell = belief.grid.cells(view.grid.centres(np.array([1, 5])))
    assert belief.occupancy[tuple(cell)] == Occupancy.OCCUPIED
    assert belief.occupancy.sum() == view.occupancy.sum()
    assert belief.explored.sum() == 3
    assert np.isnan(belief.similarity).sum() == belief.similarity.size - 3


def test_an_empty_map_gives_a_window_around_the_robot() -> None:
    empty = SearchView(
        text="",
        revision=0,
        sequence=0,
        stamp_ns=0,
        grid=GridSpec(0.1, (0, 0), (0, 0)),
        occupancy=np.zeros((0, 0), np.uint8),
        layers=np.zeros((0, 0), np.uint8),
        similarity=np.zeros((0, 0), np.float32),
    )
    belief = belief_around(empty, np.array([3.0, -4.0]))
    assert belief.grid.contains(belief.grid.cells(np.array([3.0, -4.0])))
    assert not belief.observed.any()
    assert np.isnan(belief.similarity).all()
