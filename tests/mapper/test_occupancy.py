"""Occupancy in rooms of boxes: what may be driven over, and what must not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.tiles import AREA
from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.occupancy.evidence import OccupancyLayers, OccupancyUpdate
from onemap_mapper.occupancy.image import occupancy_update
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F64, I64
from onemap_shared.messages import Occupancy
from tests.mapper import scenes
from tests.mapper.scenes import ROOM, Box
from tests.reference import occupancy as reference

PARAMS = scenes.params()
CAMERA = Intrinsics.from_fov(320, 240, np.deg2rad(79))
SIZE = (240, 320)
TABLE = (
    Box((0.9, -0.5, 0.70), (2.1, 0.5, 0.74)),  # its top
    *(Box((x, y, 0.0), (x + 0.03, y + 0.03, 0.70)) for x in (0.95, 2.02) for y in (-0.45, 0.42)),
)
COFFEE_TABLE = Box((1.0, -0.4, 0.0), (1.8, 0.4, 0.4))


def look_around(belief: BeliefMap, boxes: tuple[Box, ...], poses: list[F64]) -> None:
    frame, last = None, None
    for T in poses:
        if frame is None or T is not last:
            depth = scenes.millimetres(scenes.depth_of(boxes, T, CAMERA, SIZE)) / np.float32(1000)
            cloud = PointCloud.of(depth, intrinsics=CAMERA, T_map_camera=T)
            frame = occupancy_update(cloud, PARAMS)
            last = T
        belief.fuse_occupancy(frame, belief.grow(frame.cells))


def seen(boxes: tuple[Box, ...], poses: list[F64]) -> BeliefMap:
    belief = BeliefMap(PARAMS)
    look_around(belief, boxes, poses)
    return belief


def turning(x_m: float, y_m: float = 0.0, height_m: float = 1.0) -> list[F64]:
    return [scenes.pose(x_m, y_m, yaw, height_m) for yaw in np.arange(0, 6.28, 0.8)]


def state_at(belief: BeliefMap, *points: tuple[float, float]) -> list[int]:
    cells = belief.grid.cells(np.array(points))
    states: list[int] = belief.shared_version().occupancy_grid()[tuple(cells.T)].tolist()
    return states


def assumed_at(belief: BeliefMap, point: tuple[float, float]) -> bool:
    cell = belief.grid.cells(np.array(point)) + np.asarray(belief.grid.origin_cell)
    rows = belief.tiles.rows(cell[None])
    return bool(belief.occupancy.assumed.values[rows][0])


def test_an_empty_room_is_free_inside_and_closed_around() -> None:
    belief = seen(ROOM, turning(0.5) + turning(-0.7, 0.5))
    x, y = np.meshgrid(np.arange(-2.85, 2.9, 0.1), np.arange(-2.35, 2.4, 0.1))
    inside = state_at(belief, *zip(x.ravel(), y.ravel(), strict=True))
    assert np.mean(np.array(inside) == Occupancy.FREE) > 0.99
    assert Occupancy.OCCUPIED not in inside
    for along in np.arange(-2.4, 2.4, 0.1):  # no hole in a wall, nor beside it
        assert Occupancy.OCCUPIED in state_at(belief, (3.05, along), (2.95, along))
        assert Occupancy.FREE not in state_at(belief, (3.05, along), (3.15, along))
    assert state_at(belief, (3.5, 0.0)) == [Occupancy.UNKNOWN]


def test_a_table_is_occupied_though_the_floor_under_it_is_seen() -> None:
    belief = seen((*ROOM, *TABLE), turning(-0.8) + turning(-1.5, 1.2) + turning(-2.5, -1.0, 0.5))
    middle = [(x, y) for x in (1.05, 1.45, 1.95) for y in (-0.35, 0.05, 0.35)]
    assert state_at(belief, *middle) == [Occupancy.OCCUPIED] * 9


def test_what_moves_away_disappears() -> None:
    belief = seen((*ROOM, COFFEE_TABLE), [scenes.pose(-0.5)] * 20)
    assert state_at(belief, (1.05, 0.0)) == [Occupancy.OCCUPIED]
    look_around(belief, ROOM, [scenes.pose(-0.5)] * 15)
    assert state_at(belief, (1.05, 0.0)) == [Occupancy.FREE]


@pytest.mark.parametrize(("dx_m", "dy_m"), [(0.0, 0.25), (-0.25, 0.0), (-0.18, -0.18)])
def test_somebody_who_walks_is_on_the_map_of_every_frame_and_then_leaves_it(
    dx_m: float, dy_m: float
) -> None:
    """At 1 m/s and 4 frames per second: in each one in other cells, which were free."""
    belief, camera = seen(ROOM, [scenes.pose(-2.0)] * 12), scenes.pose(-2.0)
    places = [(1.05 + k * dx_m, -0.75 * (dy_m > 0) + k * dy_m) for k in range(7)]
    for x, y in places:
        somebody = Box((x - 0.2, y - 0.2, 0.0), (x + 0.2, y + 0.2, 1.7))
        look_around(belief, (*ROOM, somebody), [camera])
        assert state_at(belief, (x - 0.2, y)) == [Occupancy.OCCUPIED]
    look_around(belief, ROOM, [camera] * 2)
    assert state_at(belief, *((x - 0.2, y) for x, y in places[:-1])) == [Occupancy.FREE] * 6


def test_a_doorway_stays_open() -> None:
    wall = (Box((1.0, -2.6, 0.0), (1.1, -0.4, 2.5)), Box((1.0, 0.4, 0.0), (1.1, 2.6, 2.5)))
    lintel = Box((1.0, -0.4, 2.0), (1.1, 0.4, 2.5))
    belief = seen((*ROOM, *wall, lintel), [scenes.pose(-1.5, y) for y in np.arange(-1, 1, 0.2)])
    across = state_at(belief, *((1.05, y) for y in np.arange(-0.35, 0.36, 0.1)))
    assert across[1:-1] == [Occupancy.FREE] * (len(across) - 2)
    assert state_at(belief, (1.05, -0.6), (1.05, 0.6)) == [Occupancy.OCCUPIED] * 2


def test_a_carpet_is_floor_and_what_hangs_high_is_passed_under() -> None:
    carpet = Box((1.0, -0.5, 0.0), (2.0, 0.5, 0.03))
    lamp = Box((1.4, -0.1, 1.5), (1.6, 0.1, 2.5))
    belief = seen((*ROOM, carpet, lamp), turning(-0.5))
    assert state_at(belief, (1.5, 0.0), (1.5, 0.3)) == [Occupancy.FREE] * 2


def test_depth_more_uncertain_than_a_cell_neither_makes_nor_clears_obstacles() -> None:
    room = (Box((-9, -9, -1), (9, 9, 0)), Box((6, -9, 0), (7, 9, 3)))
    depth = scenes.depth_of(room, scenes.pose(), CAMERA, SIZE)
    cloud = PointCloud.of(depth, intrinsics=CAMERA, T_map_camera=scenes.pose())
    near, far = (
        occupancy_update(cloud, scenes.params(depth_noise_m=noise_m)) for noise_m in (0.005, 0.0)
    )
    places = [(each.cells + 0.5) * 0.1 for each in (near, far)]
    for update, xy, reaches in zip((near, far), places, (False, True), strict=True):
        voxels = update.evidence[:, :-1]
        beyond = np.linalg.norm(xy, axis=1) > 4.6
        assert (voxels[beyond] > 0).any() == reaches
        assert (voxels[beyond] < 0).any() == reaches
    assert np.linalg.norm(places[0][near.clear], axis=1).max() > 5  # floor goes on


@pytest.mark.parametrize("frames", [2, 6])
def test_a_chest_that_somebody_stood_beside_is_not_driven_over(frames: int) -> None:
    """They share a cell, whose upper half is seen through when the robot is too near for its
    camera to see the chest: what goes with it counts as floor that no camera saw."""
    chest = Box((1.93, -0.25, 0.0), (2.3, 0.05, 0.5))
    person = Box((1.93, 0.05, 0.0), (2.3, 0.35, 1.05))
    belief = seen(ROOM, [scenes.pose(-0.5)] * 2)
    look_around(belief, (*ROOM, chest), [scenes.pose(-0.5)] * 4)
    look_around(belief, (*ROOM, chest, person), [scenes.pose(-0.5)] * frames)
    look_around(belief, (*ROOM, chest), [scenes.pose(1.65)] * 14)
    shared, beside, gone = ((1.95, 0.02), (1.95, -0.15), (1.95, 0.25))
    assert state_at(belief, beside) == [Occupancy.OCCUPIED]
    assert state_at(belief, gone) == [Occupancy.FREE]
    assert state_at(belief, shared) == [Occupancy.OCCUPIED] or assumed_at(belief, shared)
    look_around(belief, (*ROOM, chest), [scenes.pose(-0.5)] * 4)
    assert not assumed_at(belief, gone)  # the floor is in view again


LEVELS = scenes.params().levels


def new_layers() -> OccupancyLayers:
    made = OccupancyLayers(scenes.params())
    for layer in made.layers:
        layer.grow(1)
    return made


def random_frame(rng: np.random.Generator, rows: I64) -> OccupancyUpdate:
    """Mostly a little evidence, as of real frames, some at the ends of int8."""
    evidence = rng.choice(
        np.array([-128, -4, -1, 0, 0, 2, 4, 127], np.int8), (len(rows), LEVELS + 1)
    )
    empty = rng.random(len(rows)) < 0.5  # columns that no point lies in
    evidence[empty] = np.minimum(evidence[empty], 0)
    clear, blind = rng.random((2, len(rows))) < 0.5
    return OccupancyUpdate(np.zeros((len(rows), 2), np.int64), evidence, clear, blind)


def column_frame(*evidence: int, clear: bool = False) -> OccupancyUpdate:
    """A frame of one cell, with the evidence of the lowest voxel, of those above, of the top."""
    low, middle, top = evidence
    column = np.array([[low, *[middle] * (LEVELS - 2), top, 0]], np.int8)
    clear_blind = (np.array([clear]), np.array([False]))
    return OccupancyUpdate(np.zeros((1, 2), np.int64), column, *clear_blind)


def test_what_stands_upright_in_one_frame_is_an_obstacle_until_it_is_seen_through() -> None:
    """Evidence and what lasts stay those of all frames. A hit low and one high are no body."""
    layers, row = new_layers(), np.array([7])
    free, upright = column_frame(-1, -1, -1, clear=True), column_frame(0, 4, 0)
    noise, elsewhere = column_frame(4, 0, 4), np.array([8])
    told = []
    for frame in (*[free] * 12, noise, *[free] * 8, upright, free):
        layers.add(row, frame)
        layers.add(elsewhere, free)
        told.append(int(layers.states.values[7]))
    assert told == [Occupancy.FREE] * 21 + [Occupancy.OCCUPIED, Occupancy.FREE]
    assert int(layers.settled.values[7]) == Occupancy.FREE
    assert int(layers.evidence.values[7, :-1].max()) < 0


@settings(max_examples=60)
@given(seed=st.integers(0, 2**16), frames=st.integers(1, 12), cells=st.integers(0, 40))
def test_the_layers_are_those_of_the_rules_cell_by_cell(seed: int, frames: int, cells: int) -> None:
    rng, layers, slow = np.random.default_rng(seed), new_layers(), dict[int, reference.Cell]()
    for _ in range(frames):
        rows = rng.permutation(50)[:cells]
        frame = random_frame(rng, rows)
        different, changed = layers.add(rows, frame)
        for k, row in enumerate(rows.tolist()):
            before = slow.get(row, reference.Cell(LEVELS))
            slow[row] = after = before.after(frame.evidence[k].tolist(), bool(frame.clear[k]))
            assert different[k] == (before.looks != after.looks)
            stood = before.settled not in (Occupancy.UNKNOWN, after.settled)
            assert changed[k] == stood
        assumed = np.unique(rng.integers(0, AREA, 9))
        marked = set(assumed.repeat(2)[layers.assume(assumed.repeat(2))].tolist())
        for row in assumed.tolist():
            before = slow.get(row, reference.Cell(LEVELS))
            slow[row] = before.with_assumed_floor()
            assert (row in marked) == (before.looks != slow[row].looks)
    for row, cell in slow.items():
        assert layers.evidence.values[row].tolist() == cell.evidence
        found = [int(layer.values[row]) for layer in layers.layers[1:]]
        assert found == [cell.clear, cell.assumed, cell.state, cell.settled]
    known = [row for row, cell in slow.items() if cell.clear or any(cell.evidence)]
    assert layers.known_rows.tolist() == sorted(known)
