"""A robot that was moved says so, stands still, and goes on once the map has seen the place."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_planner.motion.motions import STOP, Pose2d
from onemap_planner.policy.displaced import STANDS_S, note_displacement
from onemap_planner.policy.outcome import Observation
from onemap_planner.policy.state import PlannerState
from onemap_planner.search.state_machine import (
    EventStamp,
    Exploring,
    Finished,
    LookingAround,
    new_search,
)
from onemap_shared.messages import After, SearchState
from tests.planner.drawn_maps import PARAMS
from tests.planner.grid_world import (
    STEP_S,
    SimulatedSearch,
    in_four_rooms,
    in_plan,
    start,
    two_rooms,
)

DRIVE, CONTROLS_PER_STEP = PARAMS.drive, 5
PERIOD_S = CONTROLS_PER_STEP * STEP_S


def on_its_way() -> SimulatedSearch:
    """A robot that looked around and drives."""
    run = start(in_four_rooms(), "vase")
    run.controls_per_step = CONTROLS_PER_STEP
    while not isinstance(run.state.search.phase, Exploring) or run.world.velocity.linear_mps < 0.3:
        assert run.now_s < 20.0
        run.step()
    return run


@pytest.mark.parametrize(
    ("by_m", "by_rad", "jumped"),
    [(0.6, 0.0, "position jumped by 0.6 m"), (0.0, -2.0, "heading jumped by")],
)
def test_it_stands_for_a_second_when_its_pose_jumps_and_drives_on(
    by_m: float, by_rad: float, jumped: str
) -> None:
    run = on_its_way()
    pose = run.world.pose
    run.world.pose = replace(pose, y_m=pose.y_m + by_m, yaw_rad=pose.yaw_rad + by_rad)
    jumped_s, speed_mps = run.now_s, run.world.velocity.linear_mps
    run.step()
    while run.state.search.slow:
        assert run.state.search.slow.startswith(f"standing still: its {jumped}")
        braking_s = speed_mps / DRIVE.max_linear_mps2
        assert run.world.velocity == STOP or run.now_s - jumped_s <= braking_s + PERIOD_S
        run.step()
    assert STANDS_S <= run.now_s - jumped_s <= STANDS_S + 2 * PERIOD_S
    assert isinstance(run.state.search.phase, Exploring)
    while run.world.velocity.linear_mps < 0.3:
        assert run.now_s - jumped_s <= 5.0
        run.step()


def test_it_looks_around_where_only_the_camera_tells_and_drives_on() -> None:
    run = on_its_way()
    run.offset_m = 0.4
    run.step()
    run.offset_m = 0.0
    run.step()
    assert run.world.velocity == STOP
    assert run.state.search.slow == (
        "standing still: what the camera sees is 0.4 m away from where the map shows it; was the "
        "robot pushed?"
    )
    turned_rad = 0.0
    while not isinstance(run.state.search.phase, Exploring) or turned_rad == 0.0:
        before, xy = run.world.pose, run.world.pose.xy
        run.step()
        assert run.world.pose.xy == pytest.approx(xy)
        turned_rad += abs(run.world.pose.yaw_rad - before.yaw_rad)
        if isinstance(run.state.search.phase, LookingAround):
            expected = "it was moved, or its position was wrong: looking around for a vase"
            assert run.state.search.reason == expected
    assert turned_rad > 6.0
    while run.world.velocity.linear_mps < 0.3:
        assert run.now_s < 60.0
        run.step()


@given(st.floats(0.0, 1.0), st.floats(0.05, 1.0))
def test_what_it_can_drive_and_small_corrections_are_no_jump(share: float, passed_s: float) -> None:
    """However late the step comes."""
    stamp = EventStamp(0.0, 0.0, (0.0, 0.0), 0.0)
    driven_m = share * DRIVE.max_linear_mps * passed_s
    turned_rad, fastest_rad = share * DRIVE.max_angular_radps * passed_s, DRIVE.max_angular_radps
    for beyond_m, beyond_rad, jumps in (
        (0.29, 0.49, False),
        (0.31 + DRIVE.max_linear_mps * passed_s, 0.0, True),
        (0.0, 0.51 + fastest_rad * passed_s, True),
    ):
        state = PlannerState(new_search("s", ("sofa",), stamp, 0), pose=Pose2d(0.0, 0.0, 0.0))
        state.last_step_s = 10.0
        pose, at_s = Pose2d(driven_m + beyond_m, 0.0, turned_rad + beyond_rad), 10.0 + passed_s
        note_displacement(state, Observation(at_s, pose, 0.0, STOP, False, None, (), ""), DRIVE)
        assert (state.displacement is not None) == jumps


@pytest.mark.parametrize(("lag_s", "jumps"), [(0.2, True), (0.9, False), (9.0, False)])
def test_a_pose_that_comes_late_is_no_jump(lag_s: float, jumps: bool) -> None:
    """A simulator that stood still for a while, or odometry that was on its way for long."""
    stamp, ns = EventStamp(0.0, 0.0, (0.0, 0.0), 0.0), 10**9
    state = PlannerState(new_search("s", ("sofa",), stamp, 0), pose=Pose2d(0.0, 0.0, 0.0))
    state.last_step_s, state.pose_ns = 10.0, 10 * ns
    seen = Observation(10.2, Pose2d(0.0, 0.0, 0.9), 0.0, STOP, False, None, (), "")
    pose_ns = 10 * ns + round(lag_s * ns)
    note_displacement(state, replace(seen, pose_ns=pose_ns), DRIVE)
    assert (state.displacement is not None) == jumps


@pytest.mark.parametrize("on_way_back", [False, True])
def test_it_does_not_return_to_coordinates_of_before_a_jump(on_way_back: bool) -> None:
    run = start(in_plan(two_rooms()), "bed")
    run.controls_per_step = CONTROLS_PER_STEP
    run.state = replace(run.state, search=replace(run.state.search, after=After.RETURN))
    while not (run.state.search.way_back if on_way_back else run.world.odometer_m > 1.0):
        assert run.now_s < 200.0
        run.step()
    run.world.pose = replace(run.world.pose, y_m=run.world.pose.y_m + 0.6)
    search = run.until_over(400.0)
    assert search.phase == Finished(SearchState.FOUND)
    assert search.reason == (
        "found 1 of 1; it did not get back to where it set out: since then the robot's position "
        "jumped or the map was replaced, and its coordinates may be another place now"
    )
    assert search.start_lost
    assert search.returned_m < 0.5
