"""Distances are exact, also where a faster transform finds them."""

import numpy as np
from hypothesis import given
from hypothesis.extra.numpy import arrays

from onemap_planner.world.distances import distances_m, distances_to_edge_m
from onemap_shared.geometry import Bool
from tests.reference.planning import clearances


@given(arrays(np.bool_, (9, 11)))
def test_distances_are_those_to_the_nearest_cell(mask: Bool) -> None:
    np.testing.assert_allclose(distances_to_edge_m(mask, 0.1), clearances(mask, 0.1))


@given(arrays(np.bool_, (9, 11)))
def test_those_within_three_cells_are_the_same_whatever_else_is_asked(mask: Bool) -> None:
    exact, near = distances_m(mask, 0.1), distances_m(mask, 0.1, 0.3)
    within = exact <= 0.3 + 1e-9
    assert np.array_equal(exact[within], near[within])
    assert (near[~within] > 0.3 + 1e-9).all()
