"""The robot moves as commanded within its limits, and obstacles stop it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_shared.command_gate import Deadman
from onemap_shared.geometry import Velocity2d
from onemap_simulator.generation.stairwell import with_stairwell
from onemap_simulator.physics.collision import CollisionMap, MissingFloor
from onemap_simulator.physics.robot import STOP, RobotParams, RobotState, step
from onemap_simulator.physics.simulation import Simulation, SimulationCounts
from tests.simulator.scenes import SceneBuilder, box_room

PARAMETERS = RobotParams()
HOLONOMIC = RobotParams(max_lateral_mps=0.4)
START = RobotState(1.0, 1.0, 0.0)
COMMANDS = st.builds(Velocity2d, st.floats(-2, 2), st.floats(-4, 4), st.floats(-2, 2))


def nowhere(x: float, y: float) -> bool:
    return False


def drive(
    state: RobotState,
    command: Velocity2d,
    seconds: float,
    dt_s: float = 0.02,
    params: RobotParams = PARAMETERS,
) -> RobotState:
    for _ in range(round(seconds / dt_s)):
        state = step(state, command, dt_s, params=params, collides=nowhere)
    return state


def test_reaches_the_commanded_speed_with_the_acceleration_limit() -> None:
    assert drive(START, Velocity2d(0.5), 0.3).velocity.linear_mps == pytest.approx(0.3)
    assert drive(START, Velocity2d(0.5), 1.0).velocity.linear_mps == pytest.approx(0.5)
    # Half a second of acceleration, then half a second at 0.5 m/s.
    assert drive(START, Velocity2d(0.5), 1.0).x_m == pytest.approx(1.0 + 0.125 + 0.25)


def test_a_holonomic_drive_moves_sideways_within_its_limits() -> None:
    left = drive(replace(START, yaw_rad=np.pi / 2), Velocity2d(0, 0, 9.0), 2.0, params=HOLONOMIC)
    assert left.velocity.lateral_mps == pytest.approx(0.4)
    assert left.x_m == pytest.approx(1.0 - 0.4 * 2.0 + 0.4**2 / 2)  # 1 m/s^2 up to the limit
    assert left.y_m == pytest.approx(1.0)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(commands=st.lists(COMMANDS, max_size=12), seed=st.integers(0, 99))
def test_is_never_inside_an_obstacle(commands: list[Velocity2d], seed: int) -> None:
    def collides(x: float, y: float) -> bool:
        return MAP.clearance_m(x, y) < PARAMETERS.radius_m

    state = replace(START, yaw_rad=float(np.random.default_rng(seed).uniform(-np.pi, np.pi)))
    for command in commands:
        for _ in range(25):
            before = state
            state = step(state, command, 0.02, params=HOLONOMIC, collides=collides)
            assert not collides(state.x_m, state.y_m)
            change = abs(state.velocity.linear_mps - before.velocity.linear_mps)
            assert change <= 0.02 + 1e-9 or state.collided


def test_a_collision_stops_and_reports_and_can_be_left_again() -> None:
    def collides(x: float, y: float) -> bool:
        return x > 1.5

    state, collided = START, False
    for _ in range(200):
        state = step(state, Velocity2d(0.7), 0.02, params=PARAMETERS, collides=collides)
        collided = collided or state.collided
    assert collided
    assert 1.47 < state.x_m <= 1.5
    for _ in range(50):
        state = step(state, Velocity2d(-0.5), 0.02, params=PARAMETERS, collides=collides)
    assert not state.collided
    assert state.x_m < 1.3


def test_deadman_holds_a_command_for_its_validity_and_then_brakes() -> None:
    deadman = Deadman(timeout_s=0.3)
    assert deadman.command_at(0.0) == STOP
    moving = deadman.with_command(Velocity2d(0.5), now_s=10.0, validity_s=5.0)
    assert moving.command_at(10.29) == Velocity2d(0.5)
    assert moving.command_at(10.3) == STOP
    assert deadman.with_command(Velocity2d(0.5), 10.0, validity_s=0.1).command_at(10.15) == STOP
    assert moving.expired_between(10.29, 10.31)
    assert not moving.expired_between(10.31, 10.33)
    assert not deadman.with_command(STOP, 10.0, 0.3).expired_between(10.29, 10.31)


MAP = CollisionMap.of(box_room(), height_m=1.1)
BOXES = (((2.5, 2.0), (3.2, 2.8)), ((2.6, 0.3), (2.9, 0.6)))


def true_clearance(x: float, y: float) -> float:
    """Distance to the room's walls and its two boxes, by hand."""
    distances = [x, 4 - x, y, 3 - y]
    for low, high in BOXES:
        dx = max(low[0] - x, 0.0, x - high[0])
        dy = max(low[1] - y, 0.0, y - high[1])
        distances.append(float(np.hypot(dx, dy)))
    return max(min(distances), 0.0)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(x=st.floats(-0.5, 4.5), y=st.floats(-0.5, 3.5))
def test_clearance_is_close_to_the_truth_and_never_above_it(x: float, y: float) -> None:
    clearance, truth = MAP.clearance_m(x, y), true_clearance(x, y)
    assert clearance <= truth + 1e-6
    assert clearance >= truth - 3 * MAP.grid.cell_size_m


def simulation(start: RobotState | None = None) -> Simulation:
    return Simulation(MAP, RobotParams(), start or RobotState(1.0, 1.5, 0.0), now_s=100.0)


def test_the_result_depends_on_time_and_not_on_how_often_it_is_asked() -> None:
    often, seldom = simulation(), simulation()
    for run in (often, seldom):
        run.receive_command(Velocity2d(0.5, 0.4), 100.0, validity_s=0.3)
    for k in range(1, 121):
        often.advance(100.0 + k / 120)
    for k in range(1, 6):
        seldom.advance(100.0 + k / 5)
    a, b = often.state, seldom.state
    assert (a.x_m, a.y_m, a.yaw_rad) == pytest.approx((b.x_m, b.y_m, b.yaw_rad), abs=0.015)
    assert a.velocity == b.velocity == Velocity2d()


def test_counts_commands_deadman_stops_and_collisions() -> None:
    run = simulation(RobotState(0.5, 1.5, np.pi))
    now_s, collided = 100.0, False
    for _ in range(100):
        now_s += 0.02
        run.receive_command(Velocity2d(0.5), now_s, validity_s=0.3)
        collided = run.advance(now_s) or collided
    assert collided
    assert run.counts.commands_received == 100
    assert 1 <= run.counts.collisions <= 3  # it leans on the wall for a second and more
    assert MAP.clearance_m(run.state.x_m, run.state.y_m) >= 0.2
    run.advance(now_s + 0.5)
    assert run.counts.deadman_stops == 1
    assert run.state.velocity.linear_mps == 0.0


def test_after_a_long_pause_it_has_not_driven_on() -> None:
    run = simulation()
    run.receive_command(Velocity2d(0.5), 100.0, validity_s=0.3)
    run.advance(100.1)
    x = run.state.x_m
    run.advance(4000.0)
    assert run.state.x_m < x + 0.05
    assert run.counts == SimulationCounts(0, 1, run.counts.deadman_stops)


def test_a_simulation_that_lags_says_so_for_a_while() -> None:
    run = simulation()
    run.advance(105.0)  # before the first command
    run.receive_command(Velocity2d(0.5), 105.0, validity_s=0.3)
    run.advance(105.2)
    assert run.lag_problem(105.2) == ""
    run.advance(106.0)
    assert "stood still for 0.8 s" in run.lag_problem(106.0)
    assert run.lag_problem(112.0) == ""


OPENING = (1.5, 1.0, 2.2, 2.0)


def test_a_joint_between_boards_is_no_missing_floor() -> None:
    builder = SceneBuilder()
    builder.add("floor", (0, 0, -0.02), (1.97, 3, 0)).add("floor", (2.03, 0, -0.02), (4, 3, 0))
    assert not MissingFloor.of(builder.build(), 1.1).touches(2.0, 1.5, 0.2)


@pytest.mark.parametrize(("opening", "edges"), [(OPENING, 1), (None, 0)])
def test_an_edge_that_is_crossed_is_counted_once(
    opening: tuple[float, float, float, float] | None, edges: int
) -> None:
    scene = with_stairwell(box_room(), opening) if opening else box_room()
    run = Simulation(
        CollisionMap.of(scene, 1.1),
        RobotParams(),
        RobotState(1.0, 1.5, 0.0),
        now_s=0.0,
        missing_floor=MissingFloor.of(scene, 1.1),
    )
    for k in range(1, 41):
        run.receive_command(Velocity2d(0.5), k * 0.05, validity_s=0.3)
        run.advance(k * 0.05)
    assert run.counts.edges_crossed == edges
