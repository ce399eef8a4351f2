"""N keeps the robot's clearance, and a robot outside N may leave."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_planner.motion.path import cost_to_go_from
from onemap_planner.world.costmap import optimistic
from onemap_shared.geometry import F64
from onemap_shared.messages import Occupancy
from tests.planner.drawn_maps import (
    NO_POINTS,
    PARAMS,
    POINT_ROBOT,
    costmap_of,
    crossable,
    drawn_map,
)
from tests.reference.planning import clearances

OPEN = drawn_map(*["." * 5] * 5, scale=5)


@settings(deadline=None, max_examples=30)
@given(arrays(np.uint8, (9, 8), elements=st.sampled_from([0, 1, 2])))
def test_navigable_is_free_with_room_for_the_robot(occupancy: np.ndarray) -> None:
    map_view = replace(drawn_map(*["." * 8] * 9), occupancy=occupancy)
    params = POINT_ROBOT.model_copy(
        update={"radius_m": 0.1, "margin_m": 0.0, "escape_below_m2": 0.0}
    )
    costmap = costmap_of(map_view, (0.05, 0.05), params)
    away = clearances(occupancy == Occupancy.OCCUPIED, 0.1)
    expected = (occupancy == Occupancy.FREE) & (away >= 0.1)
    assert (costmap.navigable == expected).all()
    assert ((costmap.cost >= 1.0) == expected).all()
    np.testing.assert_allclose(costmap.clearance_m, away, rtol=1e-6)


def test_unknown_is_not_free_but_floor_driven_over_a_metre_ago_is() -> None:
    map_view = drawn_map(*["     "] * 5, scale=4)
    trail = np.column_stack([np.linspace(0.55, 1.75, 13), np.full(13, 1.0)])
    costmap = costmap_of(map_view, (1.75, 1.0), PARAMS.costmap, trail_xy=trail)
    assert costmap.free[5, 10]
    assert not costmap.unseen[5, 10]
    assert costmap.free[5, 8]
    assert costmap.unseen[5, 8]  # the disc covered a part of this cell, furniture may begin in it
    assert not costmap.free[14, 10]  # else the robot's own steps would make way into the unknown
    assert costmap.unseen[14, 10]
    assert not costmap.free[5, 15]
    assert not costmap.navigable[5, 15]


def test_costs_rise_towards_obstacles() -> None:
    map_view = drawn_map("#####", *["....."] * 4, scale=5)
    cost = costmap_of(map_view, (1.5, 1.2), PARAMS.costmap).cost[:, 12]
    allowed = cost[cost > 0]
    assert (np.diff(allowed) <= 0).all()
    assert allowed[0] > 2.0
    assert allowed[-1] == 1.0


def test_a_robot_in_inflated_space_may_leave_it() -> None:
    map_view = drawn_map("#####", *["....."] * 4, scale=5)
    costmap = costmap_of(map_view, (0.55, 1.2), PARAMS.costmap)
    cell = (5, 12)
    assert not costmap.navigable[cell]
    assert costmap.passable[cell]
    outward = costmap.cost[5:9, 12]
    assert (np.diff(outward) < 0).all()  # cheaper the farther from the wall
    within_reach = costmap.passable & ~costmap.navigable & (costmap.clearance_m < 0.15)
    assert costmap.cost[within_reach].min() > 2 * PARAMS.costmap.dearest
    assert not costmap.passable[0, 12]


def test_a_robot_on_unseen_floor_may_drive_to_seen_floor() -> None:
    hole = np.array(OPEN.occupancy)
    hole[6:19, 6:19] = Occupancy.UNKNOWN
    costmap = costmap_of(replace(OPEN, occupancy=hole), (1.25, 1.25), PARAMS.costmap)
    assert costmap.passable[8, 12]
    assert not costmap.navigable[8, 12]
    assert costmap.cost[crossable(costmap)].min() > 1.5 * costmap.cost[costmap.navigable].max()


def test_the_way_that_the_robot_came_stays_open() -> None:
    map_view = drawn_map(*["......"] * 2, "######", *["......"] * 2, scale=5)
    map_view.occupancy[10:15, 13:17] = Occupancy.FREE  # noise narrowed the door to 0.4 m
    trail = np.column_stack([np.linspace(0.55, 1.95, 15), np.full(15, 1.45)])

    def reaches_the_other_room(trail_xy: F64) -> bool:
        costmap = costmap_of(map_view, (0.55, 0.5), PARAMS.costmap, trail_xy=trail_xy)
        cost_to_go = cost_to_go_from(costmap.cost, (5, 5), cell_size_m=0.1)
        assert not costmap.navigable[12, 14]
        return bool(np.isfinite(cost_to_go.cost_m[20, 5]))

    assert not reaches_the_other_room(NO_POINTS)
    assert reaches_the_other_room(trail)
    map_view.occupancy[12, 12:17] = Occupancy.OCCUPIED  # the door was closed since
    assert not reaches_the_other_room(trail)


def test_the_own_trail_outside_n_is_dearer_than_any_way_through_n() -> None:
    """Else the way led along what the robot had passed, nearer to obstacles than its radius."""
    map_view = drawn_map("######", *["......"] * 3, "######", scale=3)
    beside = np.column_stack([np.full(15, 0.45), np.linspace(0.25, 1.65, 15)])
    costmap = costmap_of(map_view, (0.75, 0.95), PARAMS.costmap, trail_xy=beside)
    assert costmap.navigable[7, 9]
    assert costmap.passable[4, 9]
    assert not costmap.navigable[4, 9]
    assert costmap.cost[costmap.passable & ~costmap.navigable].min() > 2 * (
        costmap.cost[costmap.navigable].max()
    )
    map_view = drawn_map("######", *["aaaaaa"] * 3, "######", scale=3)  # all of it unseen
    costmap = costmap_of(map_view, (0.75, 0.95), PARAMS.costmap, trail_xy=beside)
    assert costmap.cost[4, 9] > 1.5 * costmap.cost[costmap.navigable].max()


def test_a_footprint_hardly_reaches_over_unknown_cells() -> None:
    map_view = drawn_map(*["......"] * 3, *["      "] * 3, scale=5)
    strict = PARAMS.costmap.model_copy(update={"unknown_overlap_m": 0.1})
    costmap = costmap_of(map_view, (0.6, 1.5), strict)
    assert costmap_of(map_view, (0.6, 1.5), PARAMS.costmap).navigable[14, 15]
    assert costmap.navigable[13, 15]
    assert costmap.free[14, 15]
    assert not costmap.navigable[14, 15]


@pytest.mark.parametrize(
    ("gap", "crossed"),
    [
        pytest.param("       ", True, id="as wide as allowed"),
        pytest.param("        ", False, id="wider"),
        pytest.param("  #  ", False, id="something stands there"),
    ],
)
def test_a_narrow_gap_of_unknown_floor_is_crossed_after_looks_into_it(
    gap: str, crossed: bool
) -> None:
    map_view = drawn_map(*["." * 15 + gap + "." * 15] * 15)
    looked = np.array([[x, 1.8] for x in (0.25, 0.75, 1.25)])
    closed = costmap_of(map_view, (0.75, 0.75), PARAMS.costmap)
    opened = costmap_of(map_view, (0.75, 0.75), PARAMS.costmap, looked_into_xy=looked)
    for costmap, leads in ((closed, False), (opened, crossed)):
        cost_to_go = cost_to_go_from(costmap.cost, (7, 7), cell_size_m=0.1)
        assert np.isfinite(cost_to_go.cost_m[7, 25]) == leads
    np.testing.assert_array_equal(
        crossable(opened) & ~crossable(closed), opened.cost != closed.cost
    )
    assert opened.unseen[crossable(opened)].all()


def test_the_optimistic_way_avoids_what_was_looked_into_in_vain() -> None:
    map_view = drawn_map(*["." * 15 + " " * 12 + "." * 15] * 30)
    closed = np.array([[0.75, 2.0]])
    costmap = costmap_of(map_view, (0.75, 0.75), PARAMS.costmap, closed_xy=closed)
    hopeful = optimistic(costmap, map_view.floor_seen)
    cost_to_go = cost_to_go_from(hopeful.cost, (7, 7), cell_size_m=0.1)
    path = cost_to_go.path_to((7, 35))
    assert costmap.closed.any()
    assert not costmap.closed[tuple(path.T)].any()


def test_floor_that_no_camera_saw_beside_a_drop_is_a_drop_too() -> None:
    """Assumed floor as unknown one; what was seen to be floor stays open, also right beside it."""
    rows = [*["....."] * 2, ".. v.", "..aa.", *["....."] * 2, *["     "] * 2]
    map_view = drawn_map(*rows, scale=5)
    costmap = costmap_of(map_view, (0.5, 0.5), PARAMS.costmap)
    drop = np.argwhere(map_view.drops)
    away_m = np.linalg.norm(np.argwhere(map_view.drops >= 0)[:, None] - drop, axis=2).min(axis=1)
    near = (away_m.reshape(map_view.drops.shape) * 0.1) <= PARAMS.costmap.beside_drop_m + 1e-9
    unseen = (map_view.occupancy == Occupancy.UNKNOWN) | map_view.assumed
    assert (unseen & near).sum() > 40
    assert (unseen & ~near).any()
    np.testing.assert_array_equal(costmap.drops, map_view.drops | (unseen & near))
    assert not (costmap.drops & ~costmap.occupied).any()
    assert not costmap.passable[costmap.drops].any()


def test_no_way_back_or_out_leads_nearer_to_a_drop_than_the_robot_reaches() -> None:
    """Its own trail may lead past obstacles that are nearer."""
    trail = np.column_stack([np.linspace(0.55, 2.45, 20), np.full(20, 0.65)])
    for beside, open_to_it in (("#", True), ("v", False)):
        rows = ["." * 5, *["." + beside * 4] * 3, "." * 5]
        map_view = drawn_map(*rows, scale=5)
        map_view.occupancy[:, 5:8] = Occupancy.FREE  # 0.3 m wide, on both sides more of it
        map_view.occupancy[:, :5] = Occupancy.OCCUPIED
        drops = map_view.drops & (map_view.occupancy == Occupancy.OCCUPIED)
        map_view = replace(map_view, drops=drops)
        costmap = costmap_of(map_view, (2.45, 0.65), PARAMS.costmap, trail_xy=trail)
        assert costmap.passable[12, 6] == open_to_it
