"""Components are 8-connected, complete and disjoint."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_planner.world.map_view import components

masks = arrays(bool, st.tuples(st.integers(1, 8), st.integers(1, 8)))


def touches(one: np.ndarray, other: np.ndarray) -> bool:
    return bool((np.abs(one[:, None] - other[None]).max(axis=2) <= 1).any())


@given(masks)
def test_each_true_cell_is_in_one_component(mask: np.ndarray) -> None:
    cells = [tuple(cell) for component in components(mask) for cell in component]
    assert sorted(cells) == sorted(map(tuple, np.argwhere(mask)))


@given(masks)
def test_components_do_not_touch_and_each_is_connected(mask: np.ndarray) -> None:
    found = components(mask)
    for index, component in enumerate(found):
        assert not any(touches(component, other) for other in found[index + 1 :])
        reached, rest = component[:1], component[1:]
        while len(rest):
            near = (np.abs(rest[:, None] - reached[None]).max(axis=2) <= 1).any(axis=1)
            assert near.any()
            reached, rest = np.vstack([reached, rest[near]]), rest[~near]
