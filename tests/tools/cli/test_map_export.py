"""``onemap map export``: a file in each format, from a gateway with a fake mapper."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from onemap_gateway.config import GatewayConfig
from onemap_gateway.service import build
from onemap_shared.memory_bus import MemoryRouter
from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, EXIT_USAGE_ERROR
from tests.gateway.fakes import GRID, FakeMapper, kept_object
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


def test_an_archive_is_for_numpy(url: str, tmp_path: Path) -> None:
    exported(url, tmp_path / "flat.npz", "--text", "sofa")
    with np.load(io.BytesIO((tmp_path / "flat.npz").read_bytes())) as archive:
        assert np.nanmax(archive["similarity"]) == pytest.approx(0.9)


def test_a_picture_has_a_pixel_per_cell_and_a_world_file(url: str, tmp_path: Path) -> None:
    written = exported(url, tmp_path / "flat.png", "--text", "sofa", "--layer", "similarity")
    assert written["beside"] == [str(tmp_path / "flat.pgw")]
    image = Image.open(tmp_path / "flat.png")
    assert (image.size, image.mode) == (GRID.shape, "RGBA")
    assert len((tmp_path / "flat.pgw").read_text().splitlines()) == 6


def test_nav2_gets_two_files(url: str, tmp_path: Path) -> None:
    written = exported(url, tmp_path / "flat.yaml")
    assert written["beside"] == [str(tmp_path / "flat.pgm")]
    assert "image: flat.pgm" in (tmp_path / "flat.yaml").read_text()
    assert Image.open(tmp_path / "flat.pgm").size == GRID.shape


def test_regions_and_objects_are_features(url: str, tmp_path: Path) -> None:
    exported(url, tmp_path / "flat.geojson", "--text", "sofa", "--text", "kettle")
    features = json.loads((tmp_path / "flat.geojson").read_text())["features"]
    kinds = [each["properties"]["kind"] for each in features]
    assert kinds == ["region"] * 4 + ["object"]


def test_a_point_cloud_is_written(url: str, tmp_path: Path) -> None:
    exported(url, tmp_path / "flat.ply")
    assert (tmp_path / "flat.ply").read_bytes().startswith(b"ply\n")


@pytest.mark.parametrize(
    ("asked", "code", "reason"),
    [
        ("flat.txt", EXIT_USAGE_ERROR, "ends in .npz"),
        ("flat", EXIT_USAGE_ERROR, "ends in .npz"),
        ("flat.ply --text sofa --text bed", EXIT_USAGE_ERROR, "one --text"),
        ("flat.png --layer similarity", EXIT_USAGE_ERROR, "give one with --text"),
        ("no/folder.npz", EXIT_FAILED, "Cannot write"),
        ("flat.geojson --text flurb", EXIT_USAGE_ERROR, "flurb"),
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
