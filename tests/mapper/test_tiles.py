"""Tiles: rows of cells anywhere, and nothing allocated where nothing was seen."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from onemap_mapper.belief.tiles import AREA, SIDE, MapTooLarge, TileIndex, TileLayer
from onemap_mapper.params import MapParams

Cell = tuple[int, int]
CELLS = st.lists(st.tuples(st.integers(-400, 400), st.integers(-400, 400)), min_size=1)


@given(st.lists(st.tuples(CELLS, st.booleans()), min_size=1, max_size=4))
def test_rows_and_cells_are_inverse_and_never_move(batches: list[tuple[list[Cell], bool]]) -> None:
    index, by_torch = TileIndex(MapParams()), TileIndex(MapParams(compiled=False))
    known: dict[Cell, int] = {}
    for batch, _ in batches:
        cells = np.array(batch)
        index.allocate(torch.from_numpy(cells))
        rows = index.rows(cells)
        assert torch.equal(index.rows_on_device(torch.from_numpy(cells)), torch.from_numpy(rows))
        by_torch.allocate(torch.from_numpy(cells))
        around = np.concatenate([cells - 70, cells, cells + 70])
        np.testing.assert_array_equal(index.rows(around), by_torch.rows(around))
        np.testing.assert_array_equal(index.cells(rows), cells)
        for cell, row in zip(batch, rows.tolist(), strict=True):
            assert known.setdefault(cell, row) == row
    assert len(set(known.values())) == len(known)
    assert index.count == len({(x // SIDE, y // SIDE) for x, y in known})


@given(CELLS)
def test_crop_is_the_obvious_dense_array(batch: list[Cell]) -> None:
    index, layer = TileIndex(MapParams()), TileLayer(torch.int32, -7)
    cells = np.unique(np.array(batch), axis=0)
    index.allocate(torch.from_numpy(cells))
    layer.grow(index.count)
    layer.values[index.rows(cells)] = torch.arange(len(cells), dtype=torch.int32)
    dense = index.to_dense(layer.values.numpy(), -7)
    assert dense.shape == index.grid.shape
    expected = np.full(dense.shape, -7)
    for number, cell in enumerate(cells):
        expected[tuple(cell - np.array(index.grid.origin_cell))] = number
    np.testing.assert_array_equal(dense, expected)


def test_a_jump_beyond_the_extent_is_refused_and_changes_nothing() -> None:
    index = TileIndex(MapParams(max_extent_m=50.0))
    index.allocate(torch.tensor([[0, 0]]))
    before = index.grid
    with pytest.raises(MapTooLarge, match="pose jump"):
        index.allocate(torch.tensor([[1000, 0]]))
    assert index.grid == before
    assert index.count == 1


def test_a_layer_grows_and_keeps_its_values() -> None:
    layer = TileLayer(torch.int8, 3, (2,))
    layer.grow(1)
    layer.values[5] = torch.tensor([1, 2])
    layer.grow(4)
    assert layer.values.shape == (4 * AREA, 2)
    assert layer.values[5].tolist() == [1, 2]
    assert layer.values[AREA].tolist() == [3, 3]
    layer.grow(2)  # never shrinks
    assert len(layer.values) == 4 * AREA
    assert layer.nbytes >= layer.values.nbytes
