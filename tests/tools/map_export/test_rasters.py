"""Images of the map, read by other programs' rules."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from onemap_tools.map_export.layers import MapLayer
from onemap_tools.map_export.rasters import layer_image, nav2_pgm, nav2_yaml, world_file
from tests.tools.map_export.arrays import FREE, OCCUPIED, UNKNOWN, small_map


def nav2_states(folder: Path) -> dict[tuple[float, float], int]:
    """The state at the centre of each pixel, x and y in metres, by the rules of nav2_map_server."""
    document = yaml.safe_load((folder / "map.yaml").read_text())
    assert document["mode"] == "trinary"
    assert document["negate"] == 0
    image = np.asarray(Image.open(folder / document["image"]), np.float64)
    assert image.ndim == 2
    states: dict[tuple[float, float], int] = {}
    for row, column in np.ndindex(*image.shape):
        probability = (255 - image[row, column]) / 255
        state = UNKNOWN
        if probability > document["occupied_thresh"]:
            state = OCCUPIED
        elif probability < document["free_thresh"]:
            state = FREE
        x_m = document["origin"][0] + (column + 0.5) * document["resolution"]
        y_m = document["origin"][1] + (image.shape[0] - row - 0.5) * document["resolution"]
        states[x_m, y_m] = state
    return states


def test_nav2_reads_every_cell_at_its_place(tmp_path: Path) -> None:
    arrays = small_map()
    (tmp_path / "map.pgm").write_bytes(nav2_pgm(arrays))
    (tmp_path / "map.yaml").write_text(nav2_yaml(arrays, "map.pgm"))
    assert nav2_states(tmp_path) == {
        (-0.75, 2.25): FREE,
        (-0.25, 2.25): FREE,
        (0.25, 2.25): OCCUPIED,
        (-0.75, 2.75): OCCUPIED,
        (-0.25, 2.75): FREE,
        (0.25, 2.75): UNKNOWN,
    }


def test_a_pgm_is_one_that_others_read() -> None:
    image = Image.open(io.BytesIO(nav2_pgm(small_map())))
    assert (image.format, image.mode, image.size) == ("PPM", "L", (3, 2))


def test_a_layer_is_white_where_it_is_set() -> None:
    explored = layer_image(small_map(), MapLayer.EXPLORED)
    assert explored.tolist() == [[0, 0, 0], [255, 0, 0]]  # the lower left cell
    observed = layer_image(small_map(), MapLayer.OBSERVED)
    assert observed.tolist() == [[255, 255, 0], [255, 255, 255]]
    assert not layer_image(small_map(), MapLayer.SEARCHED).any()


def test_the_similarity_is_grey_and_opaque_where_it_is_known() -> None:
    image = layer_image(small_map(), MapLayer.SIMILARITY)
    assert image[1, 0].tolist() == [51, 51, 51, 255]
    assert image[1, 2].tolist() == [255, 255, 255, 255]
    assert image[0, 0].tolist() == [0, 0, 0, 0]
    with pytest.raises(ValueError, match="--text"):
        layer_image(small_map(text=False), MapLayer.SIMILARITY)


def test_the_world_file_places_the_upper_left_pixel() -> None:
    size_x, _, _, size_y, x_m, y_m = map(float, world_file(small_map()).splitlines())
    assert (size_x, size_y) == (0.5, -0.5)
    assert (x_m, y_m) == (-0.75, 2.75)
