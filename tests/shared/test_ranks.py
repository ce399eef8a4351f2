"""Ranks by their limits."""

from __future__ import annotations

import numpy as np

from onemap_shared.messages import ranked


def test_a_rank_counts_the_limits_below() -> None:
    limits = np.array([0.1, 0.2, 0.2, np.inf], np.float32)
    values = np.array([[0.0, 0.1], [0.15, 0.9]], np.float32)
    assert ranked(values, limits).tolist() == [[1, 1], [2, 4]]
    assert ranked(values, limits).dtype == np.uint8
