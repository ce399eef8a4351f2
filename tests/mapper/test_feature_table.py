"""Tables of features: shared with the store, or copies of some cells."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.belief import cells
from onemap_mapper.belief.cells import CellStore

CPU = torch.device("cpu")


def filled(seed: int, dtype: torch.dtype) -> CellStore:
    rng = np.random.default_rng(seed)
    store = CellStore(6, device=CPU, dtype=dtype, compiled=True)
    slots = store.add(np.zeros((int(rng.integers(1, 30)), 2), np.int64))
    features = torch.from_numpy(rng.normal(size=(len(slots), 6)).astype(np.float32))
    store.fuse(slots, features, torch.ones(len(slots)), revision=int(rng.integers(1, 9)))
    return store


@given(seed=st.integers(0, 2**16), dtype=st.sampled_from([torch.float32, torch.float16]))
@settings(max_examples=30, deadline=None)
def test_a_copy_of_some_cells_reads_as_the_store(seed: int, dtype: torch.dtype) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cells, "BLOCK", 7)
        store, rng = filled(seed, dtype), np.random.default_rng(seed)
        copied = np.flatnonzero(rng.random(store.count) < 0.6)
        table, asked = store.copied(copied), copied[rng.random(len(copied)) < 0.7]
        vectors = torch.from_numpy(rng.normal(size=(2, 6)).astype(np.float32))
        torch.testing.assert_close(table.products(asked, vectors), store.products(asked, vectors))
        rows = np.concatenate([asked[:0], *(asked[chosen] for chosen, _ in table.chunks(asked))])
        np.testing.assert_array_equal(rows, asked)
        for chosen, part in table.chunks(asked):
            assert torch.equal(part, store.features(asked[chosen]))
        assert table.count == store.count
        np.testing.assert_array_equal(table.changed_at, store.changed_at[copied])
        revision, kept = int(rng.integers(0, 10)), int(rng.integers(0, 40))
        expected = (store.changed_at.numpy() > revision) | (np.arange(store.count) >= kept)
        for each, slots in ((store, slice(None)), (store.table(), slice(None)), (table, copied)):
            changed = np.arange(store.count)[slots][expected[slots]]
            np.testing.assert_array_equal(each.changed_since(revision, kept), changed)


def test_only_the_copy_stays_as_it_was() -> None:
    store = filled(0, torch.float32)
    slots = np.arange(store.count)
    shared, copied, before = store.table(), store.copied(slots), store.features(slots)
    store.fuse(slots, -before, torch.ones(store.count), revision=10)
    ((_, still),) = copied.chunks(slots)
    ((_, live),) = shared.chunks(slots)
    assert torch.equal(still, before)
    assert torch.equal(live, store.features(slots))
    assert (shared.changed_at < 10).all()  # what it says of the time is of when it was made
