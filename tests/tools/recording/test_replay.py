"""The map of a recording, from its features or its images."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from mcap.writer import Writer
from typer.testing import CliRunner

from onemap_mapper.params import MapParams
from onemap_mapper.storage import map_file
from onemap_mapper.storage.snapshot import sha256_of, take
from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_USAGE_ERROR
from tests.mapper import scenes
from tests.tools.cli.commands import error_of
from tests.tools.recording.bags import RecordedRobot

RUNNER = CliRunner()


@pytest.fixture
def robot(tmp_path: Path) -> RecordedRobot:
    made = RecordedRobot(tmp_path)
    made.begin()
    return made


def replayed(path: Path, *options: str) -> tuple[int, dict[str, Any]]:
    result = RUNNER.invoke(app, ["replay", str(path), "--json", *options])
    document: dict[str, Any] = json.loads(result.stdout.splitlines()[-1])
    return result.exit_code, document


def test_the_map_of_all_features(robot: RecordedRobot, tmp_path: Path) -> None:
    """Also of a frame that the mapper, which was busy, did not take; bit for bit its map else."""
    robot.see(0, 1)
    robot.update()
    robot.see(2, fused=False)
    robot.see(3)
    path = robot.end()
    code, document = replayed(path)
    assert (code, document["frames_fused"], document["problems"]) == (0, 4, [])
    fields = [scenes.field(k, scenes.pose(-0.5 + 0.1 * k, 0.2, 0.5 * k)) for k in range(4)]
    assert document["sha256"] == sha256_of(take(scenes.mapped(*fields, params=MapParams())))
    config = tmp_path / "coarse.yaml"
    config.write_text("mapper: {cell_size_m: 0.2}\n")
    assert replayed(path, "--config", str(config))[1]["cells"] < document["cells"]


def test_the_images_give_a_map_of_another_encoder(robot: RecordedRobot, tmp_path: Path) -> None:
    robot.see(0, 1)
    out = tmp_path / "again.npz"
    code, document = replayed(robot.end(), "--reencode", "--out", str(out))
    assert (code, document["frames_fused"]) == (0, 2)
    assert document["encoder_id"].startswith("mini-")
    header, cells = map_file.read_header(out)
    assert (header.encoder_id, cells) == (document["encoder_id"], document["cells"])


def test_without_images_there_is_nothing_to_encode(tmp_path: Path) -> None:
    robot = RecordedRobot(tmp_path, images=False)
    robot.begin()
    robot.see(0)
    result = RUNNER.invoke(app, ["replay", str(robot.end()), "--reencode", "--json"])
    assert result.exit_code == 1
    assert "holds no images" in error_of(result)["error"]


def test_a_file_that_was_cut_off_is_read_as_far_as_it_goes(robot: RecordedRobot) -> None:
    robot.see(0, 1)
    path = robot.end()
    path.write_bytes(path.read_bytes()[:-9])
    result = RUNNER.invoke(app, ["replay", str(path)])
    assert result.exit_code == 0
    assert "It was cut off: the recorder was killed" in result.stdout


def test_a_bag_of_ros2_is_refused_with_what_plays_it(tmp_path: Path) -> None:
    path = tmp_path / "drive.mcap"
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        writer.finish()  # type: ignore[no-untyped-call]
    result = RUNNER.invoke(app, ["replay", str(path), "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "'ros2 bag play' beside 'onemap up'" in error_of(result)["error"]
