"""The sparse location blur against the double loop over the whole window."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.frame.blur import MIN_WEIGHT, BlurKernel, blur_kernel, blurred
from onemap_mapper.params import MapParams
from tests.reference import mapping as slow


def kernel(
    cells: torch.Tensor, half_width: int, depth_factor: float = 0.02, *, compiled: bool = True
) -> BlurKernel:
    params = MapParams(
        depth_factor=depth_factor, blur_half_width_cells=half_width, compiled=compiled
    )
    return blur_kernel(cells, camera_xy_m=(-0.3, 0.2), params=params)


@pytest.mark.parametrize("compiled", [False, True])
@given(seed=st.integers(0, 2**16), half_width=st.integers(0, 3), factor=st.floats(0, 0.05))
@settings(max_examples=25, deadline=None)
def test_agrees_with_the_double_loop(
    compiled: bool, seed: int, half_width: int, factor: float
) -> None:
    rng = np.random.default_rng(seed)
    cells = np.unique(rng.integers(-30, 30, (rng.integers(1, 40), 2)), axis=0)
    features = rng.normal(size=(len(cells), 3)).astype(np.float32)
    confidence = rng.uniform(0.1, 1, len(cells)).astype(np.float32)
    fast = kernel(torch.from_numpy(cells), half_width, factor, compiled=compiled)
    seen: slow.Cells = {
        (int(x), int(y)): (features[i].astype(np.float64), float(confidence[i]))
        for i, (x, y) in enumerate(cells)
    }
    expected = slow.blurred(
        seen,
        camera_xy_m=(-0.3, 0.2),
        cell_size_m=0.1,
        depth_factor=factor,
        half_width=half_width,
    )
    values, weights = slow.table(expected, fast.cells.numpy())
    tolerance = 49 * MIN_WEIGHT * 4  # what may be left out, times the largest feature
    np.testing.assert_allclose(
        blurred(fast, torch.from_numpy(features)).numpy(), values, atol=tolerance
    )
    np.testing.assert_allclose(
        blurred(fast, torch.from_numpy(confidence)).numpy(), weights, atol=tolerance
    )
    kept = {(int(x), int(y)) for x, y in fast.cells}
    assert all(c < tolerance for cell, (_, c) in expected.items() if cell not in kept)


@given(seed=st.integers(0, 2**16), half_width=st.integers(0, 7), factor=st.floats(0, 0.1))
@settings(max_examples=40, deadline=None)
def test_compiled_rows_are_those_of_torch(seed: int, half_width: int, factor: float) -> None:
    rng = np.random.default_rng(seed)
    cells = torch.from_numpy(np.unique(rng.integers(-40, 40, (rng.integers(1, 90), 2)), axis=0))
    rows = [kernel(cells, half_width, factor, compiled=compiled) for compiled in (True, False)]
    dense = []
    for each in rows:
        owner = torch.repeat_interleave(
            torch.arange(len(each.cells)),
            torch.diff(each.starts, append=torch.tensor([len(each.sources)])),
        )
        matrix = torch.zeros((110, 110, len(cells)))
        x, y = each.cells[owner].T + 55
        matrix[x, y, each.sources] = each.values
        dense.append(matrix)
    differ = (dense[0] - dense[1]).abs() > 1e-6  # only on the threshold of what is kept
    assert torch.maximum(*dense)[differ].sub(MIN_WEIGHT).abs().le(1e-9).all()
    if torch.equal(dense[0] > 0, dense[1] > 0):
        assert torch.equal(rows[0].cells, rows[1].cells)


@pytest.mark.parametrize("compiled", [False, True])
def test_a_kernel_without_width_changes_nothing(compiled: bool) -> None:
    """So that a frame without blur may do without it."""
    cells = torch.cartesian_prod(torch.arange(-7, 40), torch.arange(3, 9))[::3]
    table = torch.randn((len(cells), 5), generator=torch.Generator().manual_seed(0))
    none = kernel(cells, 0, compiled=compiled)
    assert torch.equal(none.cells, cells)
    assert torch.equal(blurred(none, table), table)
