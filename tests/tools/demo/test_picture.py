"""The picture of a demo run: map, driven path and claims."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from onemap_shared.geometry import U8
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Occupancy, SearchView
from onemap_tools.demo.picture import MIN_PIXELS_PER_CELL, DrivenPath, write_picture
from onemap_tools.demo.summary import ObjectSummary

CELL_M = 0.1
FOUND = ObjectSummary("bed", "found", "seen", (4.5, 1.0, 0.4), 30.0, 8.0, 7.0, 0.5, 0.0)
WRONG = ObjectSummary("sofa", "found", "seen", (4.5, 1.0, 0.4), 30.0, 8.0, 7.0, 9.0, 9.0)
MISSED = ObjectSummary("toilet", "not_found", "not seen", (), 60.0, 14.0, 1.0, 1.0, 1.0)


@pytest.fixture
def view() -> SearchView:
    """6 x 4 m of free floor."""
    free = np.full((60, 40), Occupancy.FREE, np.uint8)
    nothing = np.zeros((0, 0), np.float32)
    grid = GridSpec(CELL_M, (0, 0), free.shape)
    return SearchView("", 1, 1, 1, grid, free, np.zeros_like(free), nothing)


def drawn(
    path: Path,
    view: SearchView,
    *,
    trail_m: tuple[tuple[float, float], ...] = (),
    others: tuple[DrivenPath, ...] = (),
    objects: tuple[ObjectSummary, ...] = (),
) -> U8:
    write_picture(path, view, [DrivenPath(trail_m, 0.5), *others], objects)
    image = cv2.imread(str(path))
    assert image is not None
    return image.astype(np.uint8)


def test_a_cell_has_several_pixels(view: SearchView, tmp_path: Path) -> None:
    image = drawn(tmp_path / "map.png", view)
    assert min(image.shape[0] / 40, image.shape[1] / 60) >= MIN_PIXELS_PER_CELL


def test_the_driven_path_is_drawn(view: SearchView, tmp_path: Path) -> None:
    plain = drawn(tmp_path / "plain.png", view)
    marked = drawn(tmp_path / "marked.png", view, trail_m=((0.5, 3.0), (3.0, 3.0)))
    rows, columns = np.nonzero(np.any(plain != marked, axis=-1))
    assert np.ptp(columns) > 2.5 / CELL_M * MIN_PIXELS_PER_CELL  # 2.5 m along x, and the robot
    assert np.ptp(rows) < 0.2 * np.ptp(columns)
    assert rows.mean() < plain.shape[0] / 2  # y upwards: 3 m of 4 m is in the upper half


def test_the_paths_of_all_robots_are_drawn(view: SearchView, tmp_path: Path) -> None:
    first = ((0.5, 3.0), (3.0, 3.0))
    one = drawn(tmp_path / "one.png", view, trail_m=first)
    other = DrivenPath(((0.5, 1.0), (3.0, 1.0)), 0.5)
    both = drawn(tmp_path / "both.png", view, trail_m=first, others=(other,))
    rows, columns = np.nonzero(np.any(one != both, axis=-1))
    assert np.ptp(columns) > 2.5 / CELL_M * MIN_PIXELS_PER_CELL
    assert rows.min() > one.shape[0] / 2  # 1 m of 4 m is in the lower half; the first one stays


def test_only_claims_with_a_position_are_drawn(view: SearchView, tmp_path: Path) -> None:
    plain = drawn(tmp_path / "plain.png", view)
    found = drawn(tmp_path / "found.png", view, objects=(FOUND,))
    wrong = drawn(tmp_path / "wrong.png", view, objects=(WRONG,))
    missed = drawn(tmp_path / "missed.png", view, objects=(MISSED,))
    assert np.any(found != plain)
    assert np.any(wrong != found)
    assert np.array_equal(missed, plain)
