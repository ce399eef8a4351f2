"""Sums over neutral words that are kept: as computed anew, whatever changes."""

from __future__ import annotations

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.belief.cells import CellStore
from onemap_mapper.query.similarity import NeutralSums, shares, unit_cosines

CPU = torch.device("cpu")
WORDS = torch.nn.functional.normalize(torch.randn(5, 8, generator=torch.manual_seed(0)), dim=1)


def features(rng: np.random.Generator, count: int) -> torch.Tensor:
    return torch.from_numpy(rng.normal(size=(count, 8)).astype(np.float32))


@given(seed=st.integers(0, 2**16), steps=st.lists(st.sampled_from("anr"), max_size=6))
@settings(max_examples=40, deadline=None)
def test_they_follow_the_map(seed: int, steps: list[str]) -> None:
    """Cells are added, seen anew and removed; the table is asked for in between."""
    rng, store, kept = np.random.default_rng(seed), CellStore(8, device=CPU, dtype=torch.float32), 0
    sums = NeutralSums(WORDS, 20.0)
    sets = [torch.zeros(5), torch.tensor([0.0, -torch.inf, 0.0, 0.0, -torch.inf])]
    for revision, step in enumerate(["a", *steps], start=1):
        slots = torch.arange(store.count)
        if step == "a":
            slots = store.add(np.stack([np.arange(kept, kept + 4)] * 2, axis=1))
            kept += 4
        if step == "r" and store.count > 2:
            store.remove(np.array([0, 2]), revision=revision)
        elif len(slots):
            some = slots[:: int(rng.integers(1, 3))]
            ones = torch.ones(len(some))
            store.fuse(some, features(rng, len(some)), ones, revision=revision)
        weighed = 20.0 * unit_cosines(store.features(np.arange(store.count)), WORDS)
        for excluded in sets[: 1 + revision % 2]:
            fresh = torch.logsumexp(weighed + excluded, dim=1)
            kept_sums = sums.of(store, revision, excluded)
            torch.testing.assert_close(kept_sums, fresh, atol=1e-4, rtol=0)


@given(seed=st.integers(0, 2**16), temperature=st.floats(1, 300))
def test_shares_are_those_of_a_softmax(seed: int, temperature: float) -> None:
    rng = np.random.default_rng(seed)
    own, neutral = (torch.from_numpy(rng.uniform(-1, 1, shape)).float() for shape in (7, (7, 4)))
    competes = torch.tensor([True, False, True, True])
    excluded = torch.where(competes, 0.0, -torch.inf)
    together = torch.cat([own[:, None], neutral[:, competes]], dim=1)
    expected = torch.softmax(temperature * together, dim=1)[:, 0]
    sums = torch.logsumexp(temperature * neutral + excluded, dim=1)
    torch.testing.assert_close(shares(own, sums, temperature), expected, atol=1e-4, rtol=0)
