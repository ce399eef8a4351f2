"""Rounding by chance: between the two neighbours, right on average, the same in both loops."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from onemap_mapper.belief import features
from onemap_mapper.belief.cells import CellStore
from onemap_mapper.belief.features import rounded, seeds

CPU = torch.device("cpu")


@given(seed=st.integers(0, 2**16), scale=st.sampled_from([1e-6, 1e-3, 0.04, 1.0, 3e4]))
def test_a_value_becomes_one_of_its_two_neighbours(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    values = torch.from_numpy(rng.uniform(-scale, scale, (5, 33)).astype(np.float32))
    found = rounded(values, seeds(torch.from_numpy(rng.uniform(0, 300, 5)))).numpy()
    nearest = values.numpy().astype(np.float16)
    step = np.maximum(np.spacing(np.abs(nearest)), np.spacing(np.abs(found))).astype(np.float64)
    assert (np.abs(found.astype(np.float64) - values.numpy()) <= step).all()


@given(seed=st.integers(0, 2**16))
def test_what_a_float16_holds_stays_as_it_is(seed: int) -> None:
    rng = np.random.default_rng(seed)
    exact = torch.from_numpy(rng.normal(size=(4, 64)).astype(np.float16))
    found = rounded(exact.float(), seeds(torch.from_numpy(rng.uniform(0, 300, 4))))
    assert torch.equal(found, exact)


def test_the_mean_over_many_views_is_the_value() -> None:
    """A tenth of a step is rounded up one time in ten, whatever the confidences are."""
    step = 2.0**-15  # of float16 between 1/32 and 1/16
    values = torch.full((4000, 48), 0.04)
    values = (values / step).floor() * step + 0.1 * step
    for confidence in (torch.arange(4000) * 0.86 + 0.86, torch.arange(4000) * 0.013):
        up = rounded(values, seeds(confidence.double())) > values
        assert abs(up.double().mean().item() - 0.1) < 0.003
        assert (up.double().mean(dim=0) - 0.1).abs().max() < 0.03  # in each channel
        assert (up.double().mean(dim=1) - 0.1).abs().max() < 0.35  # in each view


@pytest.mark.skipif(not features.HALF, reason="numba, or float16 in the processor, is missing")
@pytest.mark.parametrize("max_prior", [3.0, 300.0])
def test_the_compiled_loop_rounds_as_torch_does(max_prior: float) -> None:
    """Up to one step of float16 where the last bit of the float32 before it differs."""
    stores = [
        CellStore(96, device=CPU, dtype=torch.float16, compiled=compiled, max_prior=max_prior)
        for compiled in (True, False)
    ]
    rng = np.random.default_rng(0)
    _, slots = (store.add(np.zeros((300, 2), np.int64)) for store in stores)
    for revision in range(12):
        some = rng.permutation(slots)[:200]
        features = torch.from_numpy(rng.normal(size=(200, 96)).astype(np.float32))
        confidence = torch.from_numpy(rng.uniform(0.0, 9.0, 200).astype(np.float32))
        for store in stores:
            store.fuse(some, features, confidence, revision=revision)
    one, two = (store.features(slots) for store in stores)
    assert (one == two).float().mean() > 0.99
    torch.testing.assert_close(one, two, atol=5e-3, rtol=0)
