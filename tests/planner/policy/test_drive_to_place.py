"""Drives to places in a simulated world of cells: on known floor only, and with every stop."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from onemap_planner.motion.motions import Drive, Pose2d
from onemap_planner.policy.goals import Goal, GoalKind
from onemap_planner.search.state_machine import Destination, Driving, Finished
from onemap_shared.messages import Occupancy, SearchKind, SearchState
from tests.planner.grid_world import GridWorld, SimulatedSearch, in_two_rooms, start, start_drive

ORIGIN = (-2.0, -1.0)  # of the floor plans, metres


def place(x: float, y: float, kind: SearchKind = SearchKind.GO_TO) -> Destination:
    """A destination at (x, y), metres from the corner of the floor plan."""
    return Destination(kind, (ORIGIN[0] + x, ORIGIN[1] + y))


def view_of(x: float, y: float) -> Destination:
    return place(x, y, SearchKind.LOOK_AT)


def drive(world: GridWorld, destination: Destination, limit_s: float = 200.0) -> SimulatedSearch:
    """The drive when it is over; every path was planned over floor known to be free."""
    run, kinds = start_drive(world, destination), list[GoalKind]()
    while run.state.search.active and run.now_s < limit_s:
        run.step()
        assert_on_known_floor(run)
        if run.decision is not None and run.decision.goal is not None:
            kinds.append(run.decision.goal.kind)
    assert not world.entered_solid
    assert kinds[0] is GoalKind.FRONTIER  # on the way, in another room
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


def test_a_place_in_a_room_that_was_never_seen_is_reached_through_its_door() -> None:
    run = drive(in_two_rooms(), place(4.0, 7.0))
    assert outcome(run) is SearchState.ARRIVED
    assert away_m(run) < 0.25  # two cells: the place may lie in a cell without room for the robot
    (result,) = run.state.search.results
    assert result.position_m == ()
    assert result.end_xy_m == pytest.approx(run.world.pose.xy, abs=0.05)
    assert run.world.odometer_m < 15.0  # it does not explore the rest
    assert run.decision is not None
    assert run.decision.goal is not None
    assert run.decision.goal.kind is GoalKind.GO_TO
    assert run.state.search.reason == f"standing {away_m(run):.2f} m from the place (2.00, 6.00)"


def test_the_middle_of_furniture_cannot_be_reached() -> None:
    run = drive(in_two_rooms(), place(1.0, 6.7))  # 0.7 m inside the bed
    assert outcome(run) is SearchState.FAILED
    assert (
        "cannot be reached: no way leads there; the nearest reachable point is 1.0 m from it"
        in (run.state.search.reason)
    )


def test_a_place_far_outside_of_the_map_is_refused_before_the_robot_moves() -> None:
    run = start_drive(in_two_rooms(), Destination(SearchKind.GO_TO, (100.0, 100.0)))
    while run.state.search.active and run.now_s < 60.0:
        run.step()
    assert outcome(run) is SearchState.FAILED
    assert run.world.odometer_m == 0.0
    assert "m outside of the map, which reaches from x -" in run.state.search.reason
    assert "explore nearer to it first" in run.state.search.reason


def test_a_place_in_another_room_is_looked_at_through_the_door_at_most() -> None:
    run = drive(in_two_rooms(), view_of(1.0, 6.7))  # the middle of the bed
    assert outcome(run) is SearchState.ARRIVED
    assert away_m(run) < 3.1
    assert run.world.pose.y_m > ORIGIN[1] + 3.0  # not through the wall
    assert run.search.destination is not None
    assert abs(run.world.pose.bearing_to(run.search.destination.xy)) < 0.3
    assert run.state.search.reason.startswith("looking at the place (-1.00, 5.70) from ")


def test_where_the_robots_own_navigation_fails_the_drive_ends_with_the_reason() -> None:
    run = start_drive(in_two_rooms(), place(4.0, 1.0))
    run.until_over(6.0)
    assert isinstance(run.state.search.phase, Driving)
    run.refused = Pose2d(2.0, 0.5, 0.0)
    run.step()
    assert status_of(run) is SearchState.FAILED
    assert run.state.search.reason == "the robot's own navigation found no way to (2.0, 0.5)"


def test_a_search_takes_another_goal_where_the_robots_own_navigation_fails() -> None:
    run = start(in_two_rooms(), "sofa")
    goal: Goal | None = None
    while goal is None:
        run.step()
        goal = run.decision.goal if run.decision else None
    run.refused = Pose2d(goal.viewpoint_xy[0], goal.viewpoint_xy[1], 0.0)
    run.step()
    assert "found no way to" in run.state.search.slow
    for _ in range(20):
        run.step()
        active = run.state.active_goal
        assert active is None or not active.goal.looks_at(goal.look_xy, 0.5)


def status_of(run: SimulatedSearch) -> SearchState | None:
    phase = run.state.search.phase
    return phase.state if isinstance(phase, Finished) else None
