"""Drives to places in a simulated world of cells: on known floor only, and with every stop."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from onemap_planner.motion.motions import STOP, Drive, Pose2d, Reverse
from onemap_planner.policy.goals import GoalKind
from onemap_planner.search.state_machine import (
    Destination,
    Driving,
    Finished,
    LookingAround,
)
from onemap_shared.messages import Occupancy, SearchKind, SearchState
from tests.planner.grid_world import (
    FloorPlan,
    GridWorld,
    SimulatedSearch,
    in_two_rooms,
    start_drive,
)

ORIGIN = (-2.0, -1.0)  # of the floor plans, metres


def place(x: float, y: float, kind: SearchKind = SearchKind.GO_TO) -> Destination:
    """A destination at (x, y), metres from the corner of the floor plan."""
    return Destination(kind, (ORIGIN[0] + x, ORIGIN[1] + y))


def view_of(x: float, y: float) -> Destination:
    return place(x, y, SearchKind.LOOK_AT)


def drive(world: GridWorld, destination: Destination, limit_s: float = 200.0) -> SimulatedSearch:
    """The drive when it is over; every path was planned over floor known to be free."""
    run = start_drive(world, destination)
    while run.state.search.active and run.now_s < limit_s:
        run.step()
        assert_on_known_floor(run)
    assert not world.entered_solid
    return run


def assert_on_known_floor(run: SimulatedSearch) -> None:
    """The path crosses only cells that are free, or around the robot where no camera looks."""
    if run.decision is None or not isinstance(run.decision.motion, Drive):
        return
    world, points = run.world, run.decision.motion.points_xy
    legs = [np.linspace(start, end, 50) for start, end in pairwise(points)]
    along = np.vstack(legs or [points])
    away_m = np.hypot(*(along - np.asarray(world.pose.xy)).T)
    cells = world.floor_plan.grid.cells(along[away_m > 1.2])
    known = world.occupancy[cells[:, 0], cells[:, 1]]
    trail = np.array(run.state.trail)
    for cell, state in zip(cells, known, strict=True):
        centre = world.floor_plan.grid.centres(cell)
        driven = np.hypot(*(trail - centre).T).min() <= 0.3
        assert state == Occupancy.FREE or (driven and state != Occupancy.OCCUPIED)


def outcome(run: SimulatedSearch) -> SearchState:
    (result,) = run.state.search.results
    assert run.state.search.phase == Finished(result.outcome), run.reasons
    assert result.name == ""
    return result.outcome


def away_m(run: SimulatedSearch) -> float:
    assert run.search.destination is not None
    return run.world.pose.distance_to(run.search.destination.xy)


def test_a_place_in_the_same_room_is_reached() -> None:
    run = drive(in_two_rooms(), place(1.2, 3.0))
    assert outcome(run) is SearchState.ARRIVED
    assert away_m(run) < 0.2
    assert run.state.search.reason == f"standing {away_m(run):.2f} m from the place (-0.80, 2.00)"


def test_a_place_in_a_room_that_was_never_seen_is_reached_through_its_door() -> None:
    run = drive(in_two_rooms(), place(4.0, 7.0))
    assert outcome(run) is SearchState.ARRIVED
    assert away_m(run) < 0.25  # two cells: the place may lie in a cell without room for the robot
    (result,) = run.state.search.results
    assert result.position_m == ()
    assert result.end_xy_m == pytest.approx(run.world.pose.xy, abs=0.05)
    assert run.world.odometer_m < 15.0  # it does not explore the rest


def test_the_middle_of_furniture_cannot_be_reached() -> None:
    run = drive(in_two_rooms(), place(1.0, 6.7))  # 0.7 m inside the bed
    assert outcome(run) is SearchState.FAILED
    assert (
        "cannot be reached: no way leads there; the nearest reachable point is 1.0 m from it"
        in (run.state.search.reason)
    )


def test_a_place_outside_cannot_be_reached() -> None:
    run = drive(in_two_rooms(), place(20.0, 30.0))
    assert outcome(run) is SearchState.FAILED
    assert "the place (18.00, 29.00) cannot be reached" in run.state.search.reason


def test_furniture_is_looked_at_from_a_distance() -> None:
    run = drive(in_two_rooms(), view_of(3.8, 1.2))  # the middle of the table
    assert outcome(run) is SearchState.ARRIVED
    assert 0.7 < away_m(run) < 3.1
    assert run.search.destination is not None
    assert abs(run.world.pose.bearing_to(run.search.destination.xy)) < 0.3
    assert run.state.search.reason.startswith("looking at the place (1.80, 0.20) from ")


def test_a_place_in_another_room_is_looked_at_through_the_door_at_most() -> None:
    run = drive(in_two_rooms(), view_of(1.0, 6.7))  # the middle of the bed
    assert outcome(run) is SearchState.ARRIVED
    assert away_m(run) < 3.1
    assert run.world.pose.y_m > ORIGIN[1] + 3.0  # not through the wall
    assert run.search.destination is not None
    assert abs(run.world.pose.bearing_to(run.search.destination.xy)) < 0.3


def test_a_stale_map_stops_the_robot_and_the_drive_goes_on_after_it() -> None:
    run = start_drive(in_two_rooms(), place(4.0, 7.0))
    while run.now_s < 9.0:
        run.step()
    before = run.state
    assert isinstance(before.search.phase, Driving)
    run.stale_reason = "the map is 1.2 s old"
    for _ in range(10):
        run.step()
        assert run.world.velocity == STOP
    assert run.state.search == before.search
    run.stale_reason = ""
    assert run.until_over(200.0).phase == Finished(SearchState.ARRIVED)


def test_a_missing_map_fails_the_drive_with_the_reason() -> None:
    run = start_drive(in_two_rooms(), place(4.0, 7.0))
    run.stale_reason = "the mapper is not there"
    assert run.until_over(60.0).phase == Finished(SearchState.FAILED)
    assert run.state.search.reason.endswith("the mapper is not there")


def test_a_restarted_mapper_makes_it_look_around_again() -> None:
    run = start_drive(in_two_rooms(), place(4.0, 7.0))
    while run.now_s < 30.0:
        run.step()
    run.world.forget()
    run.step()
    assert isinstance(run.state.search.phase, LookingAround)
    assert run.until_over(200.0).phase == Finished(SearchState.ARRIVED)


class Glass(GridWorld):
    """A world with a wall of glass across the room, which no camera sees."""

    def _touches(self, x: float, y: float) -> bool:
        left = self.floor_plan.grid.bounds_m[0]
        return super()._touches(x, y) or abs(x - (left + 3.0)) < 0.2


def test_a_wall_that_no_map_shows_fails_the_drive() -> None:
    floor_plan = FloorPlan(np.zeros((60, 40), bool))
    for wall in ((0, 0, 6, 0.1), (0, 3.9, 6, 4), (0, 0, 0.1, 4), (5.9, 0, 6, 4)):
        floor_plan.wall(*wall)
    world = Glass(floor_plan, Pose2d(ORIGIN[0] + 1.0, ORIGIN[1] + 2.0, 0.0))
    run = start_drive(world, place(5.0, 2.0))
    reversed_once = False
    while run.state.search.active and run.now_s < 300.0:
        run.step()
        reversed_once |= run.decision is not None and isinstance(run.decision.motion, Reverse)
    assert outcome(run) is SearchState.FAILED
    assert reversed_once
    assert run.now_s < 300.0


def test_the_time_limit_ends_a_drive() -> None:
    run = start_drive(in_two_rooms(), place(4.0, 7.0))
    explore = run.config.explore.model_copy(update={"object_limit_s": 5.0})
    run.config = run.config.model_copy(update={"explore": explore})
    assert run.until_over(60.0).phase == Finished(SearchState.FAILED)
    assert run.state.search.reason == "not reached within 5 s, the limit for one object"


def test_on_the_way_the_goal_is_a_frontier_and_then_the_place() -> None:
    run = start_drive(in_two_rooms(), place(4.0, 7.0))
    kinds: list[GoalKind] = []
    while run.state.search.active:
        run.step()
        goal = run.decision.goal if run.decision else None
        if goal is not None and (not kinds or kinds[-1] is not goal.kind):
            kinds.append(goal.kind)
    assert kinds[0] is GoalKind.FRONTIER
    assert kinds[-1] is GoalKind.GO_TO
