"""Two methods on the same apartments: ratios, differences, and intervals of pairs."""

from __future__ import annotations

import pytest

from onemap_tools.bench.navigation.comparison import comparison
from onemap_tools.bench.navigation.records import Failure
from tests.tools.bench.navigation.records import episode, failed, found

GOOD = [episode(k, found("bed", 4, 4 + k), found("sofa", 2, 2)) for k in range(4)]
# Half as efficient in each apartment, and the second object wrong in the first of them.
POOR = [
    episode(0, found("bed", 4, 8), failed("sofa", 3, Failure.WRONG_OBJECT)),
    *[episode(k, found("bed", 4, 2 * (4 + k)), found("sofa", 2, 4)) for k in (1, 2, 3)],
]


def test_pairs_have_narrow_intervals() -> None:
    compared = comparison(GOOD, POOR, seed=1)
    first = compared["spl_1"]
    assert (first.value, first.low, first.high) == (2.0, 2.0, 2.0)
    assert compared["spl_2"].value == pytest.approx(1 / (1.5 / 4), abs=1e-3)
    assert compared["sr"].value == pytest.approx(1 / 8)
    assert compared["wrong_claims"].value == pytest.approx(-1 / 8)
    assert "spl_3" not in compared


def test_only_common_apartments_count() -> None:
    assert comparison(GOOD[1:], POOR[:2], seed=1)["sr"].value == 0.0
    with pytest.raises(ValueError, match="no apartment in common"):
        comparison(GOOD[:1], POOR[1:], seed=1)
