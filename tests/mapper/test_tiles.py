"""Tiles, and from where cells were seen best."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.belief import view_log
from onemap_mapper.belief.tiles import NO_ROW, SIDE, TileIndex, TileLayer
from onemap_mapper.belief.view_log import ViewLog
from onemap_mapper.params import MapParams
from onemap_shared.geometry import camera_mount, pose_2d

Cell = tuple[int, int]
CELLS = st.lists(st.tuples(st.integers(-400, 400), st.integers(-400, 400)), min_size=1)


@settings(max_examples=40)
@given(st.lists(CELLS, min_size=1, max_size=4))
def test_rows_and_cells_are_inverse_and_never_move(batches: list[list[Cell]]) -> None:
    index = TileIndex(MapParams())
    known: dict[Cell, int] = {}
    for batch in batches:
        cells = np.array(batch)
        rows = index.allocate(cells)
        np.testing.assert_array_equal(index.rows(cells), rows)
        np.testing.assert_array_equal(index.cells(rows), cells)
        known_tiles = {tuple(tile) for tile in index.places()}
        for cell in np.concatenate([cells - 70, cells + 70]):
            assert (index.rows(cell[None])[0] == NO_ROW) != (tuple(cell // SIDE) in known_tiles)
        for cell, row in zip(batch, rows.tolist(), strict=True):
            assert known.setdefault(cell, row) == row
    assert len(set(known.values())) == len(known)
    assert index.count == len({(x // SIDE, y // SIDE) for x, y in known})


@settings(max_examples=40)
@given(CELLS)
def test_crop_is_the_obvious_dense_array(batch: list[Cell]) -> None:
    index, layer = TileIndex(MapParams()), TileLayer(np.int32, -7)
    cells = np.unique(np.array(batch), axis=0)
    index.allocate(cells)
    layer.grow(index.count)
    layer.values[index.rows(cells)] = np.arange(len(cells))
    dense = index.to_dense(layer.values, -7)
    assert dense.shape == index.grid.shape
    expected = np.full(dense.shape, -7)
    for number, cell in enumerate(cells):
        expected[tuple(cell - np.array(index.grid.origin_cell))] = number
    np.testing.assert_array_equal(dense, expected)


ROWS = np.arange(4)


@pytest.fixture
def log() -> ViewLog:
    made = ViewLog()
    made.grow(1)
    return made


def record(
    log: ViewLog, x_m: float, confidence: list[float], stamp_ns: int, yaw_rad: float = 0.5
) -> None:
    log.record(
        ROWS,
        np.array(confidence, np.float32),
        T_map_camera=pose_2d(x_m, 2.0, yaw_rad) @ camera_mount(0.0, 1.0, 0.2),
        stamp_ns=stamp_ns,
    )


def test_the_best_view_of_a_region_is_that_of_most_of_its_confidence(log: ViewLog) -> None:
    record(log, 0.0, [1, 1, 1, 1], 10)
    record(log, 1.0, [3, 3, 0.5, 0.5], 20)
    np.testing.assert_allclose(log.best_view(ROWS), [1.0, 2.0, 0.5], atol=1e-6)
    np.testing.assert_allclose(log.best_view(ROWS[2:]), [0.0, 2.0, 0.5], atol=1e-6)
    assert log.last_seen_ns(ROWS) == 20


def test_views_that_are_best_for_no_cell_are_forgotten(
    log: ViewLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(view_log, "FIRST_PRUNING", 8)
    log._prune_at = 8
    for step in range(1, 100):
        record(log, 0.5 * step, [step, 1, 1, 1], step)
        assert log.best_view(ROWS[:1])[0] == pytest.approx(0.5 * step)
        assert log.best_view(ROWS[1:])[0] == pytest.approx(0.5)
    assert len(log._poses) <= 9
