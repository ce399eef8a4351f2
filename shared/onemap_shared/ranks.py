"""Ranks of cosines from the limits between them, so that limits travel in place of ranks."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F32, U8


def ranked(values: F32, limits: F32) -> U8:
    """Rank (...) of each value (...): 1 and the number of ascending limits (at most 254) below."""
    below = np.searchsorted(limits, values, side="left")
    ranks: U8 = (below + 1).astype(np.uint8)
    return ranks
