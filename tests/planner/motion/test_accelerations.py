"""Compiled functions of the collision monitor compute what their slow twins do."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_planner.motion.accelerations import nearest_edges
from tests.reference import edges


@pytest.mark.parametrize("cells", [0, 1, 40])
def test_distances_to_the_nearest_edges_are_those_of_all(cells: int) -> None:
    rng = np.random.default_rng(cells)
    points, centres = rng.uniform(-1, 1, (25, 2)), rng.uniform(-1, 1, (cells, 2))
    points[:cells] = centres[:25]  # inside
    nearest = nearest_edges(points, centres, 0.1)
    np.testing.assert_array_equal(nearest, edges.nearest_edges(points, centres, 0.1))
    assert (nearest[:cells] == 0).all()
