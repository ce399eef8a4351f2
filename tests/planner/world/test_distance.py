"""Distances are those of the slow twin, as far as they are computed."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_planner.world.costmap import distances_m
from tests.reference.planning import clearances


@settings(deadline=None)
@given(
    arrays(bool, (11, 9), elements=st.booleans() | st.just(value=False)),
    st.floats(0.01, 0.7),
    st.sampled_from([0.05, 0.1]),
)
def test_near_distances_are_exact_and_far_ones_infinite(
    mask: np.ndarray, within_m: float, cell_size_m: float
) -> None:
    away_m = clearances(mask, cell_size_m)
    found_m = distances_m(mask, cell_size_m, within_m, less_m=cell_size_m / 2)
    near = found_m < np.inf
    np.testing.assert_array_equal(found_m[near], away_m[near])
    assert (away_m[~near] > within_m).all()
    assert (away_m[near] <= within_m + cell_size_m).all()
