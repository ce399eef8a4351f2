"""Archives of a gateway, and what is none."""

from __future__ import annotations

import io

import numpy as np
import pytest

from onemap_gateway.present.views import map_archive
from onemap_tools.map_export.map_arrays import read_archive
from tests.gateway.fakes import GRID, search_view


def test_an_archive_of_the_gateway_is_read() -> None:
    view = search_view("sofa")
    arrays = read_archive(map_archive(view))
    np.testing.assert_array_equal(arrays.occupancy, view.occupancy)
    np.testing.assert_array_equal(arrays.similarity, view.similarity)
    assert arrays.origin_m == pytest.approx(GRID.bounds_m[:2])
    assert arrays.cell_size_m == GRID.cell_size_m
    assert arrays.known.sum() == (view.occupancy > 0).sum()


def archive(**arrays: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "no map"),
        (b"<html>", "no map"),
        (archive(occupancy=np.zeros((2, 2), np.uint8)), "no map"),
        (
            archive(
                occupancy=np.zeros((2, 2), np.uint8),
                layers=np.zeros((3, 2), np.uint8),
                similarity=np.zeros((0, 0), np.float32),
                origin_m=np.zeros(2),
                cell_size_m=np.array(0.1),
            ),
            "shapes that differ",
        ),
    ],
)
def test_what_is_no_map_is_refused(content: bytes, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        read_archive(content)
