from __future__ import annotations

import numpy as np
import pytest

from onemap_shared.geometry import F64, Velocity2d
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.people import (
    GAP_M,
    NOBODY,
    PATIENCE_S,
    START_AWAY_M,
    People,
    PeopleParams,
    WalkableFloor,
)
from onemap_simulator.physics.robot import RobotParams, RobotState
from onemap_simulator.physics.simulation import Simulation
from tests.simulator.scenes import box_room

ROOM = box_room()
FLOOR = WalkableFloor.of(ROOM, 0.25)


def people(count: int = 3, seed: int = 0, robot_xy: tuple[float, float] = (1.0, 1.0)) -> People:
    rng = np.random.default_rng(seed)
    params = PeopleParams(count=count)
    return People(FLOOR, params, rng, robot_xy=robot_xy, robot_radius_m=0.2)


def walked(walkers: People, seconds: float, robot_xy: tuple[float, float] = (9.0, 9.0)) -> F64:
    """Places (steps, people, 2) every 0.02 s."""
    steps = []
    for _ in range(round(seconds / 0.02)):
        walkers.advance(0.02, robot_xy)
        steps.append(walkers.bystanders.places)
    return np.array(steps)


def test_people_walk_on_free_floor_at_most_as_fast_as_set_and_a_seed_repeats_it() -> None:
    steps = walked(people(), 40.0)
    collision = CollisionMap.of(ROOM, 1.7)
    clearances = [collision.clearance_m(*place) for place in steps[::10].reshape(-1, 2)]
    assert min(clearances) >= 0.2
    speeds = np.linalg.norm(np.diff(steps, axis=0), axis=-1) / 0.02
    assert speeds.max() <= 1.0 + 1e-6
    assert np.median(speeds) >= 0.4
    assert np.ptp(steps, axis=0).min() > 0.5  # each gets about
    np.testing.assert_array_equal(steps, walked(people(), 40.0))
    assert not np.array_equal(steps, walked(people(seed=1), 40.0))


def test_people_start_away_from_the_robot_and_stop_before_it() -> None:
    for seed in range(5):
        robot_xy = (2.0, 1.5)
        walkers = people(2, seed, robot_xy)
        start = np.linalg.norm(walkers.bystanders.places - robot_xy, axis=1)
        assert start.min() >= START_AWAY_M
        steps = walked(walkers, 60.0, robot_xy)
        away = np.linalg.norm(steps - robot_xy, axis=-1)
        assert away.min() >= 0.25 + 0.2 + GAP_M - 1e-9
    assert away.min() < 1.0  # they do come near
    assert walkers.distance_m(*steps[-1, 0]) == pytest.approx(-0.25)


@pytest.mark.parametrize("seed", range(4))
def test_whom_the_robot_stopped_goes_elsewhere(seed: int) -> None:
    robot_xy = (2.0, 1.5)
    places = walked(people(2, seed, robot_xy), 90.0, robot_xy)
    span = round(2.5 * PATIENCE_S / 0.02)
    spans = np.lib.stride_tricks.sliding_window_view(places, span, axis=0)[::50]
    assert np.ptp(spans, axis=-1).max(axis=-1).min() > 0


def test_a_path_leads_past_the_robot_only_where_there_is_room() -> None:
    cells = np.zeros_like(FLOOR.cells)
    cells[4:37, 12] = True  # a corridor along x at y = 1.25 m, one cell wide
    corridor, rng = WalkableFloor(FLOOR.grid, cells), np.random.default_rng(0)

    def farthest_m(robot_xy: tuple[float, float]) -> float:
        paths = [corridor.path((0.45, 1.25), rng, robot_xy=robot_xy, gap_m=0.75) for _ in range(30)]
        return max(x for path in paths for x, _ in path)

    assert farthest_m((2.05, 1.25)) <= 2.05 - 0.75 + 1e-6
    assert farthest_m((2.05, 2.25)) > 2.05


def test_without_people_or_floor_nobody_is_there() -> None:
    assert People.of(ROOM, PeopleParams(), np.random.default_rng(0), robot_radius_m=0.2) is None
    nowhere = WalkableFloor(FLOOR.grid, np.zeros_like(FLOOR.cells))
    nobody = People(
        nowhere,
        PeopleParams(count=2),
        np.random.default_rng(0),
        robot_xy=(1.0, 1.0),
        robot_radius_m=0.2,
    )
    nobody.advance(0.02, (1.0, 1.0))
    assert nobody.bystanders.places.shape == (0, 2)
    assert nobody.distance_m(1.0, 1.0) == np.inf
    rng = np.random.default_rng(0)
    assert nowhere.path((1.0, 1.0), rng, robot_xy=(1.0, 1.0), gap_m=0.75) == ()


class Statue(People):
    """One person who never moves, at (2, 1.5)."""

    def __init__(self) -> None:
        super().__init__(
            FLOOR,
            PeopleParams(count=1),
            np.random.default_rng(0),
            robot_xy=(9.0, 9.0),
            robot_radius_m=0.2,
        )
        self._walkers[0].place = (2.0, 1.5)

    def advance(self, dt_s: float, robot_xy: tuple[float, float]) -> None:
        """Stand still."""


def test_driving_into_a_person_is_a_contact_and_counted_as_such() -> None:
    def drive(who: People | None, start: RobotState) -> Simulation:
        run = Simulation(CollisionMap.of(ROOM, 1.1), RobotParams(), start, now_s=0.0, people=who)
        for k in range(1, 100):
            run.receive_command(Velocity2d(0.5), k * 0.02, validity_s=0.3)
            run.advance(k * 0.02)
        return run

    touched = drive(Statue(), RobotState(1.0, 1.5, 0.0))
    assert (touched.counts.collisions > 0, touched.counts.people_touched > 0) == (True, True)
    assert touched.counts.people_touched == touched.counts.collisions
    assert touched.state.x_m <= 2.0 - 0.45
    assert len(touched.bystanders.places) == 1
    wall = drive(Statue(), RobotState(1.0, 2.5, np.pi))
    assert wall.counts.collisions > 0
    assert wall.counts.people_touched == 0
    alone = drive(None, RobotState(1.0, 1.5, 0.0))
    assert alone.counts.collisions == 0
    assert alone.bystanders is NOBODY
