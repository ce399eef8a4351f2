"""Compares two methods on the same episodes: ratios and differences with paired intervals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onemap_shared.geometry import F64
from onemap_tools.bench.navigation.metrics import (
    Estimate,
    estimate,
    ratios_of,
    resampling_weights,
)
from onemap_tools.bench.navigation.records import EpisodeRecord

RATIOS = ("spl", "sequence_spl", "spl_1", "spl_2", "spl_3", "path_m")
DIFFERENCES = ("sr", "wrong_claims")


def comparison(
    own: Sequence[EpisodeRecord], other: Sequence[EpisodeRecord], seed: int
) -> dict[str, Estimate]:
    """Own over other for ``RATIOS``, own less other for ``DIFFERENCES``, by name.

    Both on the apartments that both searched, resampled together; ValueError if there are none.
    """
    first, second = ({each.seed: each for each in episodes} for episodes in (own, other))
    common = sorted(first.keys() & second.keys())
    if not common:
        raise ValueError("the runs have no apartment in common: compare runs of the same seeds")
    weights, once = resampling_weights(len(common), seed), np.ones((1, len(common)))
    mine = ratios_of([first[apartment] for apartment in common])
    theirs = ratios_of([second[apartment] for apartment in common])
    found = {}
    for name in (*RATIOS, *DIFFERENCES):
        if name in mine:
            both = [
                _compared(mine[name].of(each), theirs[name].of(each), name in RATIOS)
                for each in (weights, once)
            ]
            found[name] = estimate(both[0], float(both[1][0]))
    return found


def _compared(own: F64, other: F64, as_ratio: bool) -> F64:
    if not as_ratio:
        return own - other
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient: F64 = own / other
    return quotient
