from __future__ import annotations

import numpy as np

from onemap_simulator.scene.spawn import (
    LAMP_SPACING_M,
    MAX_LAMPS,
    ROBOT_CLEARANCE_M,
    ceiling_lamps,
    free_space,
    start_pose,
)
from tests.simulator.scenes import WALL_SIDES, SceneBuilder, box_room


def test_free_space_keeps_clear_of_walls_and_furniture() -> None:
    grid, clearance = free_space(box_room())
    places = grid.centres(np.argwhere(clearance > 0))
    assert len(places)
    assert (places > ROBOT_CLEARANCE_M - grid.cell_size_m).all()
    assert (places < np.array([4, 3]) - ROBOT_CLEARANCE_M + grid.cell_size_m).all()
    in_sofa = (places > (2.5, 2.0)).all(axis=1) & (places < (3.2, 2.8)).all(axis=1)
    assert not in_sofa.any()


def test_the_larger_of_two_rooms_is_the_free_space() -> None:
    builder = SceneBuilder().add("floor", (0, 0, 0), (6, 3, 2.5), sides=("z-", *WALL_SIDES))
    builder.add("wall", (1.9, 0, 0), (2.1, 3, 2.5))
    grid, clearance = free_space(builder.build())
    assert grid.centres(np.argwhere(clearance > 0))[:, 0].min() > 2.1


def test_only_floor_is_free_where_there_is_floor() -> None:
    builder = SceneBuilder().add("floor", (0, 0, 0), (3, 3, 0.1), sides=("z-",))
    grid, clearance = free_space(builder.add("ball", (5, 5, 0), (6, 6, 1)).build())
    assert grid.centres(np.argwhere(clearance > 0)).max() < 3.0


def test_a_scene_without_a_floor_stands_on_a_plane() -> None:
    builder = SceneBuilder().add("wall", (0, 0, 0), (0.1, 4, 2)).add("wall", (4, 0, 0), (4.1, 4, 2))
    _, clearance = free_space(builder.build())
    assert clearance.any()


def test_the_start_is_the_roomiest_place_and_faces_the_middle() -> None:
    grid, clearance = free_space(box_room())
    pose = start_pose(grid, clearance)
    assert pose is not None
    cell = grid.cells(np.array(pose[:2]))
    assert clearance[tuple(cell)] == clearance.max()
    middle = grid.centres(np.argwhere(clearance > 0)).mean(axis=0)
    ahead = middle - pose[:2]
    np.testing.assert_allclose(ahead / np.linalg.norm(ahead), (np.cos(pose[2]), np.sin(pose[2])))
    assert start_pose(grid, np.zeros_like(clearance)) is None


def test_lamps_are_spread_and_limited() -> None:
    builder = SceneBuilder().add("floor", (0, 0, 0), (20, 20, 2.5), sides=("z-", *WALL_SIDES))
    grid, clearance = free_space(builder.build())
    places = np.array([lamp.position_m[:2] for lamp in ceiling_lamps(grid, clearance)])
    assert len(places) == MAX_LAMPS
    apart = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(len(places), 1)]
    assert apart.min() > LAMP_SPACING_M
    assert ceiling_lamps(grid, np.zeros_like(clearance)) == ()
