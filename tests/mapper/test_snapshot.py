"""Snapshots: what is taken out of a map makes the same map again, and no other fits."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_mapper.storage.snapshot import (
    MapSnapshot,
    restore,
    take,
)
from tests.mapper import scenes

PARAMS = scenes.params()


@pytest.fixture(scope="module")
def belief() -> BeliefMap:
    belief = made(PARAMS)
    belief.reset_searched()
    belief.fuse(compute_update(scenes.field(3, scenes.pose()), PARAMS))
    return belief


def restored(snapshot: MapSnapshot, encoder_id: str = "encoder-a", **changes: object) -> BeliefMap:
    params = scenes.params(**changes)
    return restore(snapshot, params, encoder_id=encoder_id, first_revision=9)


@pytest.mark.parametrize("dtype", ["float32", "float16"])
def test_a_restored_map_is_the_same_map(belief: BeliefMap, dtype: str) -> None:
    if dtype == "float16":
        belief = restored(take(belief), feature_dtype=dtype)
    again = restored(take(belief), feature_dtype=dtype)
    assert (again.encoder_id, again.text_space, again.dimension) == ("encoder-a", "space-a", 16)
    history = again.history()
    assert (again.frames_fused, history.sequence) == (4, 3)
    assert history.stamp_ns == belief.history().stamp_ns
    assert again.revision == 9
    slots = scenes.slots_of(again, belief.store.cells)
    everything = np.arange(belief.store.count)
    pairs = (
        (again.store.features(slots), belief.store.features(everything)),
        (again.store.confidence[slots], belief.store.confidence),
        (again.store.searched_confidence[slots], belief.store.searched_confidence),
        (again.store.explored_confidence[slots], belief.store.explored_confidence),
    )
    for have, want in pairs:
        np.testing.assert_array_equal(have, want)
    np.testing.assert_array_equal(again.shared_version().layers(), belief.shared_version().layers())
    np.testing.assert_array_equal(
        again.shared_version().occupancy_grid(), belief.shared_version().occupancy_grid()
    )


def made(config: MapParams, frames: int = 3) -> BeliefMap:
    fields = (scenes.field(k, scenes.pose(-0.5, 0.2, 2.0 * k)) for k in range(frames))
    return scenes.mapped(*fields, params=config)
