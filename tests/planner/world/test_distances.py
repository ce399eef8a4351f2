"""Distances are exact, also where a faster transform finds them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_planner.world.distances import distances_m, distances_to_edge_m
from onemap_shared.geometry import Bool
from tests.reference.planning import clearances


@given(arrays(np.bool_, (9, 11)), st.sampled_from([0.05, 0.1]))
def test_distances_are_those_of_the_slow_twin(mask: Bool, cell_size_m: float) -> None:
    found_m = distances_to_edge_m(mask, cell_size_m)
    np.testing.assert_array_equal(found_m, clearances(mask, cell_size_m))


@given(arrays(np.bool_, (9, 11)))
def test_those_within_three_cells_are_the_same_whatever_else_is_asked(mask: Bool) -> None:
    exact, near = distances_m(mask, 0.1), distances_m(mask, 0.1, 0.3)
    within = exact <= 0.3 + 1e-9
    assert np.array_equal(exact[within], near[within])
    assert (near[~within] > 0.3 + 1e-9).all()
