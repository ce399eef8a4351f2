"""Numbers by slot keep their values while a map grows and shrinks."""

from __future__ import annotations

import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.belief.features import SlotValues


@given(counts=st.lists(st.integers(0, 40), max_size=12))
@settings(max_examples=60, deadline=None)
def test_values_stay_and_new_ones_are_zero(counts: list[int]) -> None:
    kept, expected = SlotValues(2, torch.device("cpu")), torch.zeros((2, 0))
    for step, count in enumerate(counts, start=1):
        kept.resize(count)
        grown = torch.zeros((2, count))
        same = min(count, expected.shape[1])
        grown[:, :same] = expected[:, :same]
        assert kept.count == count
        assert torch.equal(kept.values, grown)
        kept.values[:, ::2] = step
        grown[:, ::2] = step
        expected = grown
