"""``onemap map export``: a file in each format, read as other programs read it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image
from typer.testing import CliRunner

from onemap_gateway.config import GatewayConfig
from onemap_gateway.service import build
from onemap_shared.messages import Layer, Occupancy
from onemap_tools.cli.app import app
from onemap_tools.cli.map import MapLayer
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, EXIT_USAGE_ERROR
from onemap_tools.map_export import MapArrays, layer_image, nav2_pgm, nav2_yaml
from tests.gateway.fakes import GRID, FakeMapper, kept_object
from tests.memory_bus import MemoryRouter
from tests.tools.cli.commands import error_of

RUNNER = CliRunner()


@pytest.fixture
def url() -> Iterator[str]:
    router = MemoryRouter()
    mapper = FakeMapper(router, objects=[kept_object()])
    worker = build(router.bus("gateway"), GatewayConfig(port=0))
    yield f"http://127.0.0.1:{worker.port}"
    worker.close()
    mapper.bus.close()


def exported(url: str, file: Path, *options: str) -> dict[str, object]:
    result = RUNNER.invoke(app, ["map", "export", str(file), "--url", url, "--json", *options])
    assert result.exit_code == EXIT_OK, result.output
    written: dict[str, object] = json.loads(result.stdout.splitlines()[-1])
    assert written["path"] == str(file)
    return written


def test_archives_pictures_and_maps_for_nav2_are_read(url: str, tmp_path: Path) -> None:
    exported(url, tmp_path / "flat.npz", "--text", "sofa")
    with np.load(tmp_path / "flat.npz") as archive:
        assert np.nanmax(archive["similarity"]) == pytest.approx(0.9)
    written = exported(url, tmp_path / "flat.png", "--text", "sofa", "--layer", "similarity")
    assert written["beside"] == [str(tmp_path / "flat.pgw")]
    image = Image.open(tmp_path / "flat.png")
    assert (image.size, image.mode) == (GRID.shape, "RGBA")
    assert len((tmp_path / "flat.pgw").read_text().splitlines()) == 6
    written = exported(url, tmp_path / "flat.yaml")
    assert written["beside"] == [str(tmp_path / "flat.pgm")]
    assert "image: flat.pgm" in (tmp_path / "flat.yaml").read_text()
    assert Image.open(tmp_path / "flat.pgm").size == GRID.shape


@pytest.mark.parametrize(
    ("asked", "code", "reason"),
    [
        ("flat.txt", EXIT_USAGE_ERROR, "ends in .npz"),
        ("flat", EXIT_USAGE_ERROR, "ends in .npz"),
        ("flat.png --layer similarity", EXIT_USAGE_ERROR, "give one with --text"),
        ("no/folder.npz", EXIT_FAILED, "Cannot write"),
        ("flat.npz --text flurb", EXIT_USAGE_ERROR, "flurb"),
    ],
)
def test_what_cannot_be_written_is_refused(
    url: str, tmp_path: Path, asked: str, code: int, reason: str
) -> None:
    name, *options = asked.split()
    command = ["map", "export", str(tmp_path / name), "--url", url, "--json", *options]
    result = RUNNER.invoke(app, command)
    assert result.exit_code == code
    assert reason in str(error_of(result)["error"])
    assert list(tmp_path.iterdir()) == []


UNKNOWN, FREE, OCCUPIED = Occupancy.UNKNOWN, Occupancy.FREE, Occupancy.OCCUPIED


def small_map(*, text: bool = True) -> MapArrays:
    """The occupancy as one sees it from above, y up: # . ? over . . #."""
    occupancy = np.array([[FREE, OCCUPIED], [FREE, FREE], [OCCUPIED, UNKNOWN]], np.uint8)
    layers = np.where(occupancy != UNKNOWN, Layer.OBSERVED, 0).astype(np.uint8)
    layers[0, 0] |= Layer.EXPLORED
    similarity = np.full((3, 2), np.nan, np.float32)
    similarity[0, 0], similarity[2, 0] = 0.2, 1.0
    none = np.zeros((0, 0), np.float32)
    return MapArrays(occupancy, layers, similarity if text else none, (-1.0, 2.0), 0.5)


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


def test_a_layer_is_white_where_it_is_set_and_the_similarity_opaque_where_known() -> None:
    explored = layer_image(small_map(), MapLayer.EXPLORED)
    assert explored.tolist() == [[0, 0, 0], [255, 0, 0]]  # the lower left cell
    observed = layer_image(small_map(), MapLayer.OBSERVED)
    assert observed.tolist() == [[255, 255, 0], [255, 255, 255]]
    image = layer_image(small_map(), MapLayer.SIMILARITY)
    assert image[1, [0, 2]].tolist() == [[51, 51, 51, 255], [255, 255, 255, 255]]
    assert image[0, 0].tolist() == [0, 0, 0, 0]
