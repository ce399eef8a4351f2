from __future__ import annotations

import numpy as np
import pytest

from onemap_perception.encoders.mini import MiniParams
from onemap_tools.bench.transport.link_loss import Variant, loss, run

RNG = np.random.default_rng(0)
BEFORE = RNG.uniform(-1, 1, (400, 3)).astype(np.float32)


def test_nothing_is_lost_where_nothing_changed() -> None:
    same = loss(BEFORE, BEFORE)
    assert same["cosine_change_mean"] == same["cosine_change_p99"] == 0
    assert same["rank_correlation"] == same["rank_correlation_least"] == same["best_kept"] == 1


def test_a_shift_changes_cosines_and_not_their_order() -> None:
    shifted = loss(BEFORE, BEFORE + np.float32(0.1))
    assert shifted["cosine_change_mean"] == pytest.approx(0.1)
    assert shifted["rank_correlation"] == shifted["best_kept"] == 1


def test_one_word_that_is_turned_round_is_seen() -> None:
    after = BEFORE.copy()
    after[:, 1] *= -1
    turned = loss(BEFORE, after)
    assert turned["rank_correlation_least"] == pytest.approx(-1)
    assert turned["rank_correlation"] == pytest.approx(1 / 3, abs=0.01)
    assert turned["best_kept"] == pytest.approx(2 / 3, abs=0.01)


@pytest.mark.slow
def test_the_encoder_is_measured() -> None:
    variants = (Variant(), Variant(quality=30), Variant(int8=True), Variant(channels=64))
    rows = {row.pop("variant"): row for row in run(MiniParams(), (160, 120), 3, variants)}
    assert list(rows) == ["raw", "jpeg 30", "int8", "64 channels", "variance log8"]
    assert rows["raw"]["cosine_change_p99"] == 0
    assert rows["jpeg 30"]["cosine_change_mean"] > rows["int8"]["cosine_change_mean"] > 0
    assert rows["int8"]["rank_correlation"] > 0.999
    assert 0 < rows["variance log8"]["relative_change_mean"] < 0.02
