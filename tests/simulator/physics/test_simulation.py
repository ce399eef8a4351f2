from __future__ import annotations

import numpy as np
import pytest

from onemap_shared.geometry import Velocity2d
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.robot import RobotParams, RobotState
from onemap_simulator.physics.simulation import Simulation, SimulationCounts
from tests.simulator.scenes import box_room

SCENE = box_room()
COLLISION = CollisionMap.of(SCENE, 1.1)


def simulation(start: RobotState | None = None) -> Simulation:
    return Simulation(
        COLLISION,
        RobotParams(),
        start or RobotState(1.0, 1.5, 0.0),
        now_s=100.0,
    )


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
    assert COLLISION.clearance_m(run.state.x_m, run.state.y_m) >= 0.2
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


def test_a_start_too_close_to_an_obstacle_is_refused() -> None:
    with pytest.raises(ValueError, match=r"0\.10 m from an obstacle; its radius is 0\.2 m"):
        simulation(RobotState(0.1, 1.0, 0.0))
