"""The ways to normalise the blur: alike where a whole window was seen, apart at the rim."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from onemap_mapper.frame.blur import blur_kernel, blurred
from onemap_mapper.params import BlurParams
from onemap_tools.bench.rim import WAYS, Way, both_renormalised, confidence_weighted, whole

PARAMS = BlurParams(depth_factor=0.03, blur_half_width_cells=2)
SIDE = 15
CELLS = torch.cartesian_prod(torch.arange(SIDE), torch.arange(SIDE))


@pytest.mark.parametrize("way", WAYS)
def test_where_a_whole_even_window_was_seen_all_are_alike(way: Way) -> None:
    kernel = blur_kernel(CELLS, camera_xy_m=(-2.0, 0.0), params=PARAMS)
    features, confidence = torch.full((len(CELLS), 3), 0.7), torch.full((len(CELLS),), 0.4)
    F, c = way(kernel, features, confidence)
    inner = ((kernel.cells >= 4) & (kernel.cells < SIDE - 4)).all(dim=1)
    assert inner.any()
    torch.testing.assert_close(F[inner], torch.full_like(F[inner], 0.7), atol=5e-3, rtol=0)
    torch.testing.assert_close(c[inner], torch.full_like(c[inner], 0.4), atol=5e-3, rtol=0)
    if way is whole:
        assert torch.equal(F, blurred(kernel, features))
        assert F[:, 0].min() < 0.1  # what a renormalised mean does not lose
    else:
        torch.testing.assert_close(F, torch.full_like(F, 0.7))
    assert (c.min() > 0.39) == (way is both_renormalised)


def test_a_sure_neighbour_counts_more_than_an_unsure_one() -> None:
    cells = torch.tensor([[0, 0], [0, 2]])
    kernel = blur_kernel(cells, camera_xy_m=(-4.0, 0.1), params=PARAMS)
    between = np.flatnonzero((kernel.cells == torch.tensor([0, 1])).all(dim=1).numpy())
    features, confidence = torch.tensor([[1.0], [0.0]]), torch.tensor([0.9, 0.1])
    F, _ = confidence_weighted(kernel, features, confidence)
    assert 0.85 < F[between[0], 0] < 0.95
