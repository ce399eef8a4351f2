"""The belief of cells: fusion in any order, float16 rounded by chance."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.belief import cells
from onemap_mapper.belief.cells import CellStore, fused, gain
from onemap_mapper.belief.features import half_bits, half_value
from onemap_mapper.params import MapParams
from tests.reference import mapping as slow

CPU = torch.device("cpu")


def new_store(dtype: torch.dtype = torch.float32, *, compiled: bool = False) -> CellStore:
    return CellStore(3, device=CPU, dtype=dtype, compiled=compiled)


@pytest.mark.parametrize("compiled", [False, True])
@given(seed=st.integers(0, 2**16))
@settings(max_examples=8, deadline=None)
def test_blocks_equal_one_dense_table(compiled: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cells, "BLOCK", 7)
        store = new_store(compiled=compiled)
        F, c = torch.zeros((40, 3)), np.zeros(40)
        for revision in range(1, 6):
            store.new_slots(rng.integers(-9, 9, (rng.integers(0, 9), 2)))
            slots = rng.permutation(store.count)[: rng.integers(0, store.count + 1)]
            F_new = torch.from_numpy(rng.normal(size=(len(slots), 3)).astype(np.float32))
            c_new = rng.uniform(0.1, 1, len(slots)).astype(np.float32)
            store.fuse(slots, F_new, c_new, revision=revision)
            K = torch.from_numpy(gain(c[slots], c_new.astype(np.float64)))
            F[slots] = fused(F[slots], F_new, K)
            c[slots] += c_new
            assert (store.changed_at[slots] == revision).all()
        everything = np.arange(store.count)
        torch.testing.assert_close(store.features(everything), F[: store.count])
        np.testing.assert_allclose(store.confidence, c[: store.count], rtol=1e-6)
        some = np.flatnonzero(rng.random(store.count) < rng.choice([0.3, 1.0]))
        for chosen, part in store.chunks(some):
            torch.testing.assert_close(part, F[some[chosen]])


def test_float16_is_read_and_written_as_numpy_does() -> None:
    bits = np.arange(2**16, dtype=np.uint16)
    values = bits.view(np.float16).astype(np.float32)
    read = np.array([half_value(each) for each in bits], np.float32)
    np.testing.assert_array_equal(read, values)
    np.testing.assert_array_equal(np.signbit(read), np.signbit(values))
    drawn = np.random.default_rng(0).integers(0, 2**32, 20_000, dtype=np.uint32)
    between = (values[:0x7BFF] + values[1:0x7C00]) / 2  # ties, with those of subnormal numbers
    with np.errstate(over="ignore", invalid="ignore"):
        for some in (values, drawn.view(np.float32), between, np.nextafter(between, np.float32(9))):
            written = np.array([half_bits(each) for each in some], np.uint16).view(np.float16)
            np.testing.assert_array_equal(written, some.astype(np.float16))
            np.testing.assert_array_equal(np.signbit(written), np.signbit(some))


VIEW = 0.86  # confidence of a frame at 2 m
LIMIT = MapParams().max_prior_confidence


def after_views(
    observations: np.ndarray, dtype: torch.dtype, max_prior: float, *, every: int
) -> np.ndarray:
    """The features (k, D) of a cell after every so many of the observations (frames, D)."""
    store = CellStore(
        observations.shape[1], device=CPU, dtype=dtype, compiled=True, max_prior=max_prior
    )
    slot = store.new_slots(np.zeros((1, 2), np.int64))
    seen = []
    for frame, new in enumerate(torch.from_numpy(observations.astype(np.float32)), start=1):
        store.fuse(slot, new[None], np.array([VIEW], np.float32), revision=frame)
        if frame % every == 0:
            seen.append(store.features(slot)[0].numpy())
    return np.array(seen, np.float64)


def unit_rows(rows: np.ndarray) -> np.ndarray:
    normalised: np.ndarray = rows / np.linalg.norm(rows, axis=-1, keepdims=True)
    return normalised


@pytest.mark.slow
def test_an_hour_follows_the_exact_belief() -> None:
    """An hour at 2 Hz of noisy views of a thing that is exchanged every ten minutes."""
    rng = np.random.default_rng(1)
    frames, things = 7200, unit_rows(rng.normal(size=(6, 64)))
    change = rng.normal(scale=0.05, size=(frames, 64))
    seen = unit_rows(np.repeat(things, frames // 6, axis=0) + change)
    exact = slow.fading_mean(seen, VIEW, LIMIT)[119::120]
    found = after_views(seen, torch.float16, LIMIT, every=120)
    assert (unit_rows(found) * unit_rows(exact)).sum(axis=1).min() > 0.9999


@pytest.mark.parametrize("max_prior", [3.0, 300.0])
def test_the_compiled_loop_rounds_as_torch_does(max_prior: float) -> None:
    """Up to one step of float16 where the last bit of the float32 before it differs."""
    stores = [
        CellStore(96, device=CPU, dtype=torch.float16, compiled=compiled, max_prior=max_prior)
        for compiled in (True, False)
    ]
    rng = np.random.default_rng(0)
    _, slots = (store.new_slots(np.zeros((300, 2), np.int64)) for store in stores)
    for revision in range(12):
        some = rng.permutation(slots)[:200]
        features = torch.from_numpy(rng.normal(size=(200, 96)).astype(np.float32))
        confidence = rng.uniform(0.0, 9.0, 200).astype(np.float32)
        for store in stores:
            store.fuse(some, features, confidence, revision=revision)
    one, two = (store.features(slots) for store in stores)
    assert (one == two).float().mean() > 0.99
    torch.testing.assert_close(one, two, atol=5e-3, rtol=0)
