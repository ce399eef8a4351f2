"""Fusion: the confidence-weighted mean, in whatever order."""

from __future__ import annotations

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.belief.cells import fused, gain


def fuse_all(features: torch.Tensor, confidences: torch.Tensor) -> tuple[torch.Tensor, ...]:
    """Fuse observations (k, n, D) with confidences (k, n) one after the other."""
    F, c = torch.zeros_like(features[0]), torch.zeros_like(confidences[0])
    for F_new, c_new in zip(features, confidences, strict=True):
        F = fused(F, F_new, gain(c, c_new))
        c = c + c_new
    return F, c


@given(seed=st.integers(0, 2**16), frames=st.integers(1, 6))
@settings(max_examples=40, deadline=None)
def test_order_does_not_matter(seed: int, frames: int) -> None:
    rng = np.random.default_rng(seed)
    features = torch.from_numpy(rng.normal(size=(frames, 5, 3)).astype(np.float32))
    confidences = torch.from_numpy(rng.uniform(0, 2, (frames, 5)).astype(np.float32))
    order = torch.from_numpy(rng.permutation(frames))
    one = fuse_all(features, confidences)
    two = fuse_all(features[order], confidences[order])
    torch.testing.assert_close(one[0], two[0], atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(one[1], two[1])


@given(seed=st.integers(0, 2**16))
@settings(max_examples=20, deadline=None)
def test_it_is_the_confidence_weighted_mean(seed: int) -> None:
    rng = np.random.default_rng(seed)
    features = torch.from_numpy(rng.normal(size=(4, 5, 3)).astype(np.float32))
    confidences = torch.from_numpy(rng.uniform(0.1, 2, (4, 5)).astype(np.float32))
    mean = (features * confidences[..., None]).sum(0) / confidences.sum(0)[:, None]
    torch.testing.assert_close(fuse_all(features, confidences)[0], mean, atol=1e-5, rtol=1e-4)


def test_nothing_seen_gives_no_nan() -> None:
    zero = torch.zeros(3)
    assert gain(zero, zero).tolist() == [0.0, 0.0, 0.0]
