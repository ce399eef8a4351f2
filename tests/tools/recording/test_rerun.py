"""A recording as a file of Rerun, read back with Rerun's own reader."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rerun", reason="needs rerun-sdk: pip install -e '.[rerun]'")

import pyarrow as pa
from rerun.chunk import RrdReader
from typer.testing import CliRunner

from onemap_gateway.present.palette import DARK
from onemap_shared import keys
from onemap_tools.cli.app import app
from onemap_tools.errors import CliError
from onemap_tools.recording.rerun_export import SHOWN, entities_of, export
from tests.gateway import fakes
from tests.shared.samples import SAMPLES
from tests.tools.recording.bags import RecordedRobot

RUNNER = CliRunner()


@pytest.fixture
def recorded(tmp_path: Path) -> Path:
    robot = RecordedRobot(tmp_path)
    robot.begin()
    robot.see(0, 1, 2)
    robot.bus.publish(keys.ROBOT_ODOMETRY).put(fakes.odometry(1.0, 2.0))
    robot.bus.publish(keys.SEARCH_PATH).put(fakes.planned_path((0.0, 0.0), (1.0, 0.5)))
    robot.bus.publish(keys.heartbeat("mapper")).put(fakes.heartbeat("mapper", problem="no frames"))
    return robot.end()


def rows(path: Path) -> dict[str, int]:
    """Rows of every entity in the file, without those that the SDK adds."""
    counts: dict[str, int] = {}
    for chunk in RrdReader(path).stream():
        if not chunk.entity_path.startswith("/__"):
            counts[chunk.entity_path] = counts.get(chunk.entity_path, 0) + chunk.num_rows
    return counts


def test_what_was_recorded_is_in_the_file(recorded: Path, tmp_path: Path) -> None:
    out = tmp_path / "drive.rrd"
    document = export(recorded, out)
    assert document["messages"]["robot/rgbd/v1"] == 3
    assert document["messages"]["map/search_view/v1"] == 1
    assert (document["problems"], document["cut_off"]) == ([], False)
    found = rows(out)
    assert found["/world/camera"] == found["/world/points"] == 3
    for entity in ("/world/map/occupancy", "/world/robot", "/world/plan/path", "/log/mapper"):
        assert found[entity] == 1, entity
    assert document["bytes"] == out.stat().st_size
    (chunk,) = (c for c in RrdReader(out).stream() if c.entity_path == "/world/robot")
    captured = chunk.to_record_batch().column("captured").cast(pa.int64()).to_pylist()
    assert captured == [fakes.STAMP_NS]


def test_a_recording_without_images_and_maps_says_so(tmp_path: Path) -> None:
    robot = RecordedRobot(tmp_path, images=False)
    robot.begin()
    robot.see(0)
    robot.mapper_bus.close()  # it gives no snapshots
    problems = export(robot.end(), tmp_path / "a.rrd")["problems"]
    assert [sentence.split(",")[0] for sentence in problems] == [
        "The recording holds no snapshots of the map",
        "The recording holds no images",
    ]


def test_the_command_says_what_it_wrote(recorded: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.rrd"
    result = RUNNER.invoke(app, ["export", "rerun", str(recorded), str(out), "--json"])
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout.splitlines()[-1])["file"] == str(out)
    again = RUNNER.invoke(app, ["export", "rerun", str(recorded), str(out)])
    assert again.exit_code == 2
    assert "exists: choose another name" in again.stderr


def test_what_is_no_recording_is_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"no recording at all")
    with pytest.raises(CliError, match="is not an MCAP file"):
        export(path, tmp_path / "a.rrd")
    assert not (tmp_path / "a.rrd").exists()


def shown(message: object) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    for entity, archetype in entities_of(message):
        found.setdefault(entity, []).append(archetype)
    return found


def values(component: Any) -> Any:
    """A component batch as Python values."""
    return component.as_arrow_array().to_pylist()


@pytest.mark.parametrize("kind", SHOWN, ids=lambda kind: kind.__name__)
def test_every_kind_of_message_can_be_shown(kind: type) -> None:
    sample = next(each for each in SAMPLES if isinstance(each, kind))
    assert shown(sample)


def test_rows_of_the_map_begin_with_the_largest_y() -> None:
    view = fakes.search_view()
    (layer,) = shown(view)["world/map/occupancy"]
    width, height = view.grid.shape
    pixels = np.array(values(layer.data)[0], np.uint8).reshape(height, width, 4)
    ix, iy = np.argwhere(view.occupancy == 2)[0]
    assert tuple(pixels[height - 1 - iy, ix, :3]) == DARK.occupied
    x_min, y_min, _, _ = view.grid.bounds_m
    assert values(layer.translation)[0][:2] == pytest.approx([x_min, y_min])
