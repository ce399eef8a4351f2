"""Whole searches of the services in virtual time, with a robot that is pushed or goes sideways."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from onemap_perception.service import components_of
from onemap_planner.config import PlannerConfig
from onemap_planner.motion.pure_pursuit import DriveParams
from onemap_shared import keys
from onemap_shared.geometry import F64
from onemap_shared.messages import SearchId, SearchRequest, SearchState, VelocityCommand
from onemap_shared.wire import Packet, decode
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.stairwell import with_stairwell
from onemap_simulator.parts import RobotParts
from onemap_simulator.physics.robot import RobotParams
from onemap_simulator.scene.scene import Scene
from onemap_simulator.service import SimulatorWorker
from onemap_tools.bench.navigation.search import WatchedSearch
from onemap_tools.virtual.config import SystemConfig
from onemap_tools.virtual.system import Equipment, simulated


def search_in(scene: Scene, config: SystemConfig, folder: Path) -> WatchedSearch:
    robot = simulated(scene, config.simulator)
    return WatchedSearch(Equipment(config, robot, components_of(config.perception), folder), 2)


def parts_of(search: WatchedSearch) -> RobotParts:
    assert isinstance(search.robot, SimulatorWorker)
    return search.robot.parts


@pytest.mark.slow
def test_a_holonomic_robot_finds_the_sofa_behind_a_stairwell_and_stays_on_the_floor(
    tmp_path: Path,
) -> None:
    """The straight way from the start to the sofa leads over an opening of 0.7 x 1 m."""
    scene = with_stairwell(generate_apartment(2), (4.5, 4.9, 5.2, 5.9))
    drive = DriveParams(max_lateral_mps=0.3)
    simulator = SimulatorConfig(seed=2, rgbd_hz=4.0, robot=RobotParams(max_lateral_mps=0.3))
    config = SystemConfig(simulator=simulator, planner=PlannerConfig(drive=drive))
    sideways = [0.0]

    def hear(key: str, packet: Packet) -> None:
        if key == keys.ROBOT_CMD_VEL.key:
            sideways.append(abs(decode(VelocityCommand, packet).lateral_mps))

    with closing(search_in(replace(scene, start=(2.3, 5.43, 0.0)), config, tmp_path)) as search:
        search.system.router.observers.append(hear)
        status = search.run(SearchRequest(("sofa",)), 60.0)
        assert [result.outcome for result in status.results] == [SearchState.FOUND]
        counts = parts_of(search).simulation.counts
        assert (counts.collisions, counts.edges_crossed) == (0, 0)
    assert 0.1 < max(sideways) <= drive.max_lateral_mps


def push_left(parts: RobotParts, by_m: float) -> None:
    """Move the robot sideways at once, of which its odometry does not tell."""
    simulation, tell = parts.simulation, parts.localisation.reported
    state = simulation.state
    pushed_m = (-by_m * float(np.sin(state.yaw_rad)), by_m * float(np.cos(state.yaw_rad)))

    def reported(T_true: F64) -> F64:
        T_map_body: F64 = tell(T_true).copy()
        T_map_body[:2, 3] -= pushed_m
        return T_map_body

    parts.localisation.reported = reported  # type: ignore[method-assign]
    x_m, y_m = np.add((state.x_m, state.y_m), pushed_m).tolist()
    simulation.state = replace(state, x_m=x_m, y_m=y_m)


@pytest.mark.slow
def test_a_robot_that_was_pushed_stops_and_goes_on_after_a_look_around_until_it_is_cancelled(
    tmp_path: Path,
) -> None:
    """It stops within one period each of camera and planner, and braking, though its odometry does
    not tell; cancelled, within 0.3 s and braking."""
    config = SystemConfig(simulator=SimulatorConfig(seed=2, rgbd_hz=4.0))
    with closing(search_in(generate_apartment(2), config, tmp_path)) as search:
        search.run(SearchRequest(("sofa",)), 0.1)
        truth, fast_mps = parts_of(search).simulation, 0.8 * config.planner.drive.max_linear_mps

        def go_on_until(within_s: float, happened: Callable[[], bool]) -> None:
            search.world.run(search.world.now_s + within_s, stop=happened)
            assert happened(), search.status

        def cancel() -> None:
            search.ask(keys.SEARCH_CANCEL, SearchId(""))

        go_on_until(60.0, lambda: truth.state.velocity.linear_mps > fast_mps)
        push_left(parts_of(search), 0.4)
        braking_mps2 = config.simulator.robot.linear_acceleration_mps2
        braking_s = truth.state.velocity.linear_mps / braking_mps2
        go_on_until(0.7 + braking_s, lambda: truth.state.velocity.speed_mps == 0.0)
        moved = "it was moved, or its position was wrong"
        go_on_until(3.0, lambda: search.status.reason.startswith(moved))
        go_on_until(30.0, lambda: truth.state.velocity.linear_mps > fast_mps)
        assert truth.counts.collisions == 0
        speed, began_xy = truth.state.velocity.linear_mps, search.xy
        cancel()
        go_on_until(0.3 + speed / braking_mps2, lambda: truth.state.velocity.linear_mps == 0.0)
        away_m = float(np.hypot(*np.subtract((truth.state.x_m, truth.state.y_m), began_xy)))
        assert away_m <= 0.35 * speed + speed**2 / (2 * braking_mps2)
