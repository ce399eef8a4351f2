"""Where further robots of a demo start."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import STYLES
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.robot import RobotParams
from onemap_simulator.scene.scene import Scene
from onemap_tools.demo.robots import MAX_ROBOTS
from onemap_tools.demo.starts import MARGIN_M, MIN_APART_M, further_starts

ROBOT = RobotParams()


@pytest.fixture(scope="module")
def scene() -> Scene:
    return generate_apartment(2, STYLES["training"])


def test_all_start_apart_on_floor_that_they_can_reach(scene: Scene) -> None:
    starts = (scene.start, *further_starts(scene, ROBOT, MAX_ROBOTS - 1))
    assert len(starts) == MAX_ROBOTS
    for one, other in combinations(starts, 2):
        assert math.dist(one[:2], other[:2]) >= MIN_APART_M
    collision = CollisionMap.of(scene, ROBOT.height_m)
    reachable = collision.reachable_cells(*scene.start[:2], ROBOT.radius_m)
    places = collision.grid.centres(np.argwhere(reachable))
    for x_m, y_m, _ in starts:
        assert collision.clearance_m(x_m, y_m) >= ROBOT.radius_m + MARGIN_M
        assert np.linalg.norm(places - (x_m, y_m), axis=1).min() < collision.grid.cell_size_m


def test_the_second_is_farther_away_than_the_third(scene: Scene) -> None:
    second, third = further_starts(scene, ROBOT, 2)
    here = scene.start[:2]
    assert math.dist(second[:2], here) >= math.dist(third[:2], here)
    assert further_starts(scene, ROBOT, 1) == (second,)


def test_they_face_the_first_robot(scene: Scene) -> None:
    ((x_m, y_m, yaw_rad),) = further_starts(scene, ROBOT, 1)
    to_x, to_y = scene.start[0] - x_m, scene.start[1] - y_m
    assert math.cos(yaw_rad) * to_x + math.sin(yaw_rad) * to_y == pytest.approx(
        math.hypot(to_x, to_y)
    )


def test_a_floor_that_is_too_small_is_refused(scene: Scene) -> None:
    with pytest.raises(ValueError, match=r"room for \d+ robots that start 1 m apart, not for 501"):
        further_starts(scene, ROBOT, 500)
    walled = replace(scene, start=(-50.0, -50.0, 0.0))  # outside of the apartment
    with pytest.raises(ValueError, match="room for 1 robots"):
        further_starts(walled, ROBOT, 1)
