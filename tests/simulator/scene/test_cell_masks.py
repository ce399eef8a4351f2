from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_shared.geometry import Bool
from onemap_simulator.scene.cell_masks import (
    clearance_m,
    connected_part,
    dilated,
    distance_m,
    largest_part,
)

masks = arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12)))


@settings(deadline=None, derandomize=True)
@given(mask=masks.filter(np.any))
def test_distance_is_that_to_the_nearest_cell_of_the_mask(mask: Bool) -> None:
    cells = np.argwhere(np.ones_like(mask))
    apart = np.linalg.norm(cells[:, None] - np.argwhere(mask), axis=2).min(axis=1)
    np.testing.assert_allclose(distance_m(mask, 0.5).ravel(), 0.5 * apart, rtol=1e-5)
    fast = distance_m(mask, 0.5, exact=False).ravel()
    np.testing.assert_allclose(fast, 0.5 * apart, rtol=0.025)


def test_clearance_counts_the_border_as_occupied() -> None:
    occupied = np.zeros((9, 9), dtype=bool)
    occupied[4, 4] = True
    clearance = clearance_m(occupied, 0.5)
    assert clearance[4, 4] == 0.0
    assert clearance[4, 6] == pytest.approx(1.0)
    assert clearance[0, 0] == pytest.approx(0.5)


def test_the_connected_part_stays_on_its_side_of_a_wall() -> None:
    reachable = np.ones((5, 5), dtype=bool)
    reachable[2] = False
    part = connected_part(reachable, np.array([0, 0]))
    assert part[:2].all()
    assert not part[2:].any()
    assert not connected_part(reachable, np.array([2, 2])).any()


def test_the_largest_part_is_connected_by_edges_only() -> None:
    mask = np.zeros((5, 5), dtype=bool)
    mask[0, :3] = mask[1, 3] = mask[3:, 3:] = True
    expected = np.zeros_like(mask)
    expected[3:, 3:] = True
    np.testing.assert_array_equal(largest_part(mask), expected)
    assert not largest_part(np.zeros((3, 3), dtype=bool)).any()


def test_dilation_reaches_the_diagonal_neighbours() -> None:
    mask = np.zeros((4, 4), dtype=bool)
    mask[1, 1] = True
    assert np.argwhere(dilated(mask)).tolist() == [[i, j] for i in range(3) for j in range(3)]
