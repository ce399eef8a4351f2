"""``onemap scene check``: exit codes, document and picture."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from onemap_tools.cli.app import app
from onemap_tools.cli.floor_plan import REACHABLE, START, THING, draw_floor_plan
from onemap_tools.cli.scene_report import document, examine
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, EXIT_USAGE_ERROR
from tests.simulator.test_inspection import room


def check(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["scene", "check", *map(str, arguments)])


def test_a_room_is_described_drawn_and_accepted(tmp_path: Path) -> None:
    picture = tmp_path / "new" / "plan.png"
    result = check(room(tmp_path), "--json", "--out", picture)
    assert result.exit_code == EXIT_OK
    report = json.loads(result.stdout)
    assert report["searchable"] is True
    assert report["categories"] == ["coffee table", "floor", "sofa"]
    assert report["triangles"] == 36
    assert report["picture"] == str(picture)
    assert "A robot can search here." in result.stderr
    image = cv2.imread(str(picture))
    assert image is not None
    assert image.shape[0] >= 500


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("a.glb", b"not a scene", "cannot be read"),
        ("a.txt", b"hello", "suffix '.txt' is not one of"),
        ("a.obj", b"# nothing\n", "a.obj"),
    ],
)
def test_a_file_that_is_not_a_scene_is_a_usage_error(
    tmp_path: Path, name: str, content: bytes, reason: str
) -> None:
    (tmp_path / name).write_bytes(content)
    result = check(tmp_path / name)
    assert result.exit_code == EXIT_USAGE_ERROR
    assert reason in result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert check(tmp_path / "nowhere.glb").exit_code == EXIT_USAGE_ERROR


def test_a_picture_that_cannot_be_written_is_reported(tmp_path: Path) -> None:
    path = room(tmp_path)
    assert check(path, "--out", tmp_path / "plan.jpg").exit_code == EXIT_USAGE_ERROR
    blocked = check(path, "--out", path / "plan.png")
    assert blocked.exit_code == EXIT_FAILED
    assert "Cannot write the picture" in blocked.stderr


def test_lengths_areas_categories_and_the_start_are_described(tmp_path: Path) -> None:
    path = room(tmp_path, yaml="categories: {Sofa-01: couch}\nstart: [-1, -1, 0.5]")
    report = document(examine(path), None)
    assert (report["start"], report["start_from_yaml"]) == ([-1.0, -1.0, 0.5], True)
    low, high = report["extent_m"]
    assert high[0] - low[0] == pytest.approx(4.0)
    assert 0 < report["reachable_m2"] < 16
    assert report["picture"] is None
    text = check(path).stdout
    for part in ("couch", "YAML", "Size: 4.00 x 4.00", "Start: (-1.00, -1.00) m", "can search"):
        assert part in text


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
