"""The floor plan that is drawn of a scene."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from onemap_tools.cli.floor_plan import REACHABLE, START, THING, draw_floor_plan, write_png
from onemap_tools.cli.scene_report import examine
from tests.simulator.test_inspection import room


def test_objects_are_drawn_where_they_stand(tmp_path: Path) -> None:
    """The sofa is at x 0.5 to 1.5, y 0.75 to 1.25, in a room of -2 to 2: right and up."""
    found = examine(room(tmp_path))
    assert found.floor is not None
    image = draw_floor_plan(found.scene, found.floor, start=None)

    def colour(x_m: float, y_m: float) -> tuple[int, ...]:
        row, column = (2 - y_m) / 4 * image.shape[0], (x_m + 2) / 4 * image.shape[1]
        return tuple(image[round(row), round(column)].tolist())

    assert colour(0.7, 0.85) == THING
    assert colour(0.7, -0.85) == REACHABLE
    assert colour(-0.7, 0.85) == REACHABLE
    with_start = draw_floor_plan(found.scene, found.floor, start=(-0.7, 0.85, 0.0))
    assert np.any(np.all(with_start == START, axis=-1))
    assert not np.any(np.all(image == START, axis=-1))


def test_a_png_holds_the_image(tmp_path: Path) -> None:
    image = np.random.default_rng(1).integers(0, 256, (4, 5, 3)).astype(np.uint8)
    write_png(tmp_path / "plan.png", image)
    read = cv2.imread(str(tmp_path / "plan.png"))
    assert read is not None
    assert np.array_equal(read, image)
    with pytest.raises(OSError, match="No such file"):
        write_png(tmp_path / "nowhere" / "plan.png", image)
