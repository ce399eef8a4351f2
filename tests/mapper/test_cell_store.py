"""The packed store against one dense table, across blocks and dtypes."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper import cell_store
from onemap_mapper.cell_store import BLOCK, CellStore
from onemap_mapper.fusion import fused, gain

CPU = torch.device("cpu")


def new_store(dtype: torch.dtype = torch.float32) -> CellStore:
    return CellStore(3, device=CPU, dtype=dtype)


@given(seed=st.integers(0, 2**16))
@settings(max_examples=20, deadline=None)
def test_blocks_equal_one_dense_table(seed: int) -> None:
    rng = np.random.default_rng(seed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cell_store, "BLOCK", 7)
        store = new_store()
        F, c = torch.zeros((40, 3)), torch.zeros(40)
        for revision in range(1, 6):
            store.add(rng.integers(-9, 9, (rng.integers(0, 9), 2)))
            slots = rng.permutation(store.count)[: rng.integers(0, store.count + 1)]
            F_new = torch.from_numpy(rng.normal(size=(len(slots), 3)).astype(np.float32))
            c_new = torch.from_numpy(rng.uniform(0.1, 1, len(slots)).astype(np.float32))
            store.fuse(slots, F_new, c_new, revision=revision)
            F[slots] = fused(F[slots], F_new, gain(c[slots], c_new))
            c[slots] += c_new
            assert (store.changed_at[slots] == revision).all()
        everything = np.arange(store.count)
        torch.testing.assert_close(store.features(everything), F[: store.count])
        torch.testing.assert_close(store.confidence, c[: store.count])
        some = np.flatnonzero(rng.random(store.count) < rng.choice([0.3, 1.0]))
        for chosen, part in store.chunks(some):
            torch.testing.assert_close(part, F[some[chosen]])


def test_float16_halves_the_memory_and_stays_close() -> None:
    rng = np.random.default_rng(0)
    single, half = new_store(), new_store(torch.float16)
    slots = single.add(np.zeros((100, 2), np.int64))
    half.add(np.zeros((100, 2), np.int64))
    for revision in range(20):
        F = torch.from_numpy(rng.normal(size=(100, 3)).astype(np.float32))
        for store in (single, half):
            store.fuse(slots, F, torch.ones(100), revision=revision)
    torch.testing.assert_close(half.features(slots), single.features(slots), atol=5e-3, rtol=0)
    assert single.nbytes - half.nbytes == BLOCK * 3 * 2


def test_memory_follows_the_number_of_cells() -> None:
    store = new_store()
    assert store.nbytes == 0
    store.add(np.zeros((BLOCK, 2), np.int64))
    one = store.nbytes
    store.add(np.zeros((1, 2), np.int64))
    assert store.nbytes == 2 * one


def test_forgetting_and_reset_touch_what_they_should() -> None:
    store = new_store()
    slots = store.add(np.zeros((2, 2), np.int64))
    store.fuse(slots, torch.ones((2, 3)), torch.tensor([1.0, 4.0]), revision=1)
    store.add_process_noise(rate_per_s=0.5, elapsed_s=2.0)
    torch.testing.assert_close(store.confidence, torch.tensor([0.5, 0.8]))
    torch.testing.assert_close(store.searched_confidence, store.confidence)
    store.reset_searched()
    assert store.searched_confidence.tolist() == [0, 0]
    torch.testing.assert_close(store.confidence, torch.tensor([0.5, 0.8]))
    torch.testing.assert_close(store.features(slots), torch.ones((2, 3)))
