"""The folder of a run: pictures with known bounds; refused early if it cannot be written."""

from __future__ import annotations

import errno
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from onemap_shared.geometry import U8
from onemap_tools.bench import scene_folder
from onemap_tools.bench.scene import SceneBenchParams, run
from onemap_tools.errors import EXIT_OK, EXIT_USAGE_ERROR
from tests.tools.bench.test_scene import ANYWHERE, bench, robot_drive


def decode_png(file: Path) -> U8:
    """BGR (H, W, 3) of a picture."""
    return np.asarray(cv2.imread(str(file)), np.uint8)


def test_without_places_the_picture_and_its_bounds_are_written(tmp_path: Path) -> None:
    path, labels, out = robot_drive(tmp_path), tmp_path / "labels.yaml", tmp_path / "out"
    labels.write_text("[]")
    result = bench(path, "--labels", labels, "--out", out)
    assert result.exit_code == EXIT_OK
    assert result.stdout.startswith("No place is labelled: the map was asked for nothing.\n")
    document = json.loads((out / "scene.json").read_text())
    assert (document["labelled"], document["places"]) == (0, [])
    assert {file.name for file in out.iterdir()} == {"scene.json", "scene.png"}
    height, width = decode_png(out / "scene.png").shape[:2]
    x_min, y_min, x_max, y_max = document["bounds_m"]
    assert width / (x_max - x_min) == pytest.approx(height / (y_max - y_min))


def test_a_place_is_drawn_where_bounds_m_says(tmp_path: Path) -> None:
    path, labels = robot_drive(tmp_path), tmp_path / "labels.yaml"
    pictures = []
    for text in ("[]", ANYWHERE):
        labels.write_text(text)
        document = run(SceneBenchParams(path, labels, out=tmp_path / "out"))
        pictures.append(decode_png(tmp_path / "out" / "scene.png").astype(int))
    x_min, y_min, x_max, y_max = document["bounds_m"]
    height, width = pictures[0].shape[:2]
    column = int((1.0 - x_min) / (x_max - x_min) * width)
    row = int((y_max - 0.0) / (y_max - y_min) * height)
    changed = np.abs(pictures[1] - pictures[0]).sum(axis=2) > 0
    assert changed[row - 4 : row + 4, column - 4 : column + 4].all()
    assert not changed[: row - 20].any()


def test_a_folder_that_cannot_be_written_is_refused_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    labels, blocked = tmp_path / "labels.yaml", tmp_path / "file"
    labels.write_text(ANYWHERE)
    blocked.touch()
    result = bench(tmp_path, "--labels", labels, "--out", blocked / "out")
    assert result.exit_code == EXIT_USAGE_ERROR
    assert result.stderr == (
        f"cannot write to {blocked / 'out'}: Not a directory; choose another --out\n"
    )
    monkeypatch.setattr(scene_folder, "TemporaryFile", fail)
    result = bench(tmp_path, "--labels", labels, "--out", tmp_path / "out")
    assert result.stderr == (
        f"cannot write to {tmp_path / 'out'}: Read-only file system; choose another --out\n"
    )
