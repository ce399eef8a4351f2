"""Pictures made in code: all kinds, repeatable, and with the contrast of pictures."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_tools.train.variety import pictures
from onemap_tools.train.variety.pictures import HEIGHT, KINDS, WIDTH, photograph


@pytest.mark.parametrize("kind", range(len(KINDS)))
def test_every_kind_makes_a_picture(kind: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "KINDS", (KINDS[kind],))
    first, again, other = (photograph(np.random.default_rng(seed)) for seed in (3, 3, 4))
    assert first.shape == (HEIGHT, WIDTH, 3)
    assert first.dtype == np.uint8
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()
    # A plain surface with the same grain has a spread of about five levels.
    assert max(float(first.std()), float(other.std())) > 10
