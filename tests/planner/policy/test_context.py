"""The context of a step: paths from the robot, and how much of the map is known."""

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.motion.motions import STOP
from onemap_planner.policy.context import build_context
from onemap_planner.policy.state import Observation, PlannerState
from onemap_planner.policy.step import step
from onemap_shared.messages import Occupancy
from tests.planner.drawn_maps import NO_POINTS, PARAMS, drawn_map, search_view_of
from tests.planner.one_room import POSE, SEARCH, context


def test_a_path_begins_at_the_robot_and_ends_at_the_viewpoint() -> None:
    drive = context().drive_to((2.55, 2.55), (3.0, 3.0))
    np.testing.assert_allclose(drive.points_xy[0], POSE.xy)
    np.testing.assert_allclose(drive.points_xy[-1], (2.55, 2.55))
    assert drive.look_xy == (3.0, 3.0)


def test_unknown_cells_lower_the_known_fraction() -> None:
    assert context().known_fraction_around() == pytest.approx(1.0, abs=0.02)
    half = search_view_of(drawn_map(*["..      "] * 8, scale=5))
    seen = build_context(POSE, half, trail=(), obstacles_xy=NO_POINTS, params=PARAMS.costmap)
    assert seen.known_fraction_around() == pytest.approx(0.5, abs=0.05)
    nothing = search_view_of(drawn_map(*["        "] * 8, scale=5))
    unseen = build_context(POSE, nothing, trail=(), obstacles_xy=NO_POINTS, params=PARAMS.costmap)
    assert unseen.known_fraction_around() == 0.0


def test_a_virtual_obstacle_is_on_the_costmap() -> None:
    view = search_view_of(drawn_map(*["." * 8] * 8, scale=5))
    obstacle = np.array([[2.05, 2.05]])
    seen = build_context(POSE, view, trail=(), obstacles_xy=obstacle, params=PARAMS.costmap)
    cell = seen.costmap.grid.cells(obstacle)[0]
    assert seen.costmap.occupied[tuple(cell)]


def test_somebody_who_appears_is_known_to_the_costmap_of_the_next_steps() -> None:
    free = search_view_of(drawn_map(*["." * 8] * 8, scale=5))
    somebody = replace(free, occupancy=free.occupancy.copy())
    somebody.occupancy[30, 20:23] = Occupancy.OCCUPIED
    state, appeared = PlannerState(SEARCH), []
    for number, shown in enumerate((free, *[somebody] * 6)):
        view = replace(shown, stamp_ns=number * 250_000_000)
        seen = Observation(0.25 * number, POSE, 0.0, STOP, False, view, (), "")
        state, decision = step(state, seen, PARAMS)
        assert decision is not None
        appeared.append(int(decision.costmap.appeared.sum()))
    assert appeared == [0, 3, 3, 3, 3, 3, 0]
