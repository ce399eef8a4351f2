"""Where floor is missing: the openings of a room, not its joints."""

from __future__ import annotations

import pytest

from onemap_shared.geometry import Velocity2d
from onemap_simulator.generation.stairwell import with_stairwell
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.missing_floor import MissingFloor
from onemap_simulator.physics.robot import RobotParams, RobotState
from onemap_simulator.physics.simulation import Simulation
from tests.simulator.scenes import SceneBuilder, box_room

OPENING = (1.5, 1.0, 2.2, 2.0)


def test_a_disc_touches_the_opening_and_nothing_else() -> None:
    floor = MissingFloor.of(with_stairwell(box_room(), OPENING), 1.1)
    assert floor.touches(1.85, 1.5, 0.01)
    assert floor.touches(1.35, 1.5, 0.2)
    assert not floor.touches(1.25, 1.5, 0.2)
    assert not floor.touches(3.0, 1.5, 0.2)
    assert not floor.touches(9.0, 9.0, 0.2)


def test_a_room_without_opening_has_floor_everywhere() -> None:
    floor = MissingFloor.of(box_room(), 1.1)
    assert not any(floor.touches(x, 1.5, 0.2) for x in (0.3, 1.0, 2.0, 3.7))


def test_a_joint_between_boards_is_no_missing_floor() -> None:
    builder = SceneBuilder()
    builder.add("floor", (0, 0, -0.02), (1.97, 3, 0)).add("floor", (2.03, 0, -0.02), (4, 3, 0))
    assert not MissingFloor.of(builder.build(), 1.1).touches(2.0, 1.5, 0.2)


def test_a_scene_without_floor_is_a_plane() -> None:
    scene = SceneBuilder().add("wall", (0, 0, 0.3), (4, 0.1, 2)).build()
    assert not MissingFloor.of(scene, 1.1).touches(2.0, 0.05, 0.2)


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
