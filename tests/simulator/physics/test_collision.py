from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_simulator.physics.collision import CollisionMap
from tests.simulator.scenes import WALL_SIDES, SceneBuilder, box_room

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


@settings(max_examples=200, deadline=None, derandomize=True)
@given(x=st.floats(-0.5, 4.5), y=st.floats(-0.5, 3.5))
def test_clearance_is_close_to_the_truth_and_never_above_it(x: float, y: float) -> None:
    clearance, truth = MAP.clearance_m(x, y), true_clearance(x, y)
    assert clearance <= truth + 1e-6
    assert clearance >= truth - 3 * MAP.grid.cell_size_m


@settings(max_examples=200, deadline=None, derandomize=True)
@given(x=st.floats(0.1, 3.9), y=st.floats(0.1, 2.9))
def test_near_an_obstacle_clearance_is_exact(x: float, y: float) -> None:
    truth = true_clearance(x, y)
    if 2 * MAP.grid.cell_size_m < truth < 0.45:
        assert abs(MAP.clearance_m(x, y) - truth) < 1e-6


def test_what_lies_above_the_robot_is_no_obstacle() -> None:
    builder = SceneBuilder().add("floor", (0, 0, 0), (4, 3, 2.5), sides=("z-", *WALL_SIDES))
    builder.add("rug", (1, 1, 0), (2, 2, 0.02)).add("lamp", (2, 1, 1.5), (3, 2, 1.8))
    collision = CollisionMap.of(builder.build(), height_m=1.1)
    assert collision.clearance_m(2.0, 1.5) > 1.4


def test_standable_cells_are_connected_to_the_place() -> None:
    builder = SceneBuilder().add("floor", (0, 0, 0), (4, 3, 2.5), sides=("z-", *WALL_SIDES))
    builder.add("wall", (1.9, 0, 0), (2.1, 3, 2.5))
    collision = CollisionMap.of(builder.build(), height_m=1.1)
    left = collision.reachable_cells(1.0, 1.5, 0.2)
    x = collision.grid.centres(np.argwhere(left))[:, 0]
    assert left.any()
    assert x.max() < 1.7
    assert not collision.reachable_cells(2.0, 1.5, 0.2).any()
    assert not collision.reachable_cells(1.0, 1.5, 5.0).any()
