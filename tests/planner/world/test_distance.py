"""Distances are those of the slow twin."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_planner.world.distances import distances_to_edge_m
from tests.reference.planning import clearances


@settings(deadline=None, max_examples=40)
@given(
    arrays(bool, (11, 9), elements=st.booleans() | st.just(value=False)),
    st.sampled_from([0.05, 0.1]),
)
def test_distances_are_exact(mask: np.ndarray, cell_size_m: float) -> None:
    found_m = distances_to_edge_m(mask, cell_size_m)
    np.testing.assert_array_equal(found_m, clearances(mask, cell_size_m))
