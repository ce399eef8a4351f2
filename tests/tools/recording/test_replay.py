"""The map of a recording, from its features or its images."""

from __future__ import annotations

import json
import subprocess
import sys
from itertools import product
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import zstandard
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from typer.testing import CliRunner

from onemap_mapper.params import MapParams
from onemap_mapper.storage import map_file
from onemap_mapper.storage.snapshot import sha256_of, take
from onemap_ros2.config import Ros2Config
from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_USAGE_ERROR
from onemap_tools.recording import replay as command
from onemap_tools.recording.bag_file import BagError
from onemap_tools.recording.ros2_frames import Ros2Bag
from tests.mapper import scenes
from tests.perception.toy import ColourEncoder
from tests.ros2.robot_messages import compressed
from tests.tools.cli.commands import error_of
from tests.tools.recording.bags import (
    CONFIG,
    MS,
    SIZE,
    T0,
    TOPICS,
    RecordedRobot,
    bag,
    drive,
    rosbag2,
)

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


def test_a_bag_whose_clocks_jump_gives_the_frames_before_and_after(tmp_path: Path) -> None:
    hour_ms = 3_600_000
    later = [(ms, kind, data) for ms, kind, data in drive(6, T0 + hour_ms * MS)]
    earlier = [(ms + 1000, kind, data) for ms, kind, data in drive(6)]
    reader = Ros2Bag(bag(tmp_path / "a.mcap", [*later, *earlier]), CONFIG)
    stamps_ms = [(frame.stamp_ns - T0) // MS % hour_ms for frame in reader.frames()]
    assert stamps_ms == [0, 100, 200, 300, 400, 500, 100, 200, 300, 400, 500]
    assert reader.problems == [
        "1 times stamps jumped back: a clock was set, or was wrong.",
        "1 images or their depth have no transform at their stamp.",
    ]


def test_what_a_bag_of_ros2_lacks_is_named(tmp_path: Path) -> None:
    late = [entry for entry in drive(6) if not (entry[1] == "tf" and entry[0] > 200)]
    reader = Ros2Bag(bag(tmp_path / "late.mcap", late), CONFIG)
    assert len(list(reader.frames())) == 3
    assert any("have no transform at their stamp" in problem for problem in reader.problems)
    path = bag(tmp_path / "a.mcap", drive())
    other = Ros2Config.model_validate({"topics": {**TOPICS, "depth": "/elsewhere"}})
    with pytest.raises(
        BagError, match=r"/elsewhere \(ros2.topics.depth\), which may be /cam/color or /cam/d"
    ):
        list(Ros2Bag(path, other).frames())
    other = Ros2Config.model_validate({"topics": {"camera_info": "/cam/info"}})
    image = "sensor_msgs/msg/CompressedImage"
    path = bag(tmp_path / "c.mcap", drive(), color=image, depth=image)
    with pytest.raises(BagError) as error:
        list(Ros2Bag(path, other).frames())
    meant = "which may be /cam/color or /cam/depth"
    assert str(error.value).endswith(
        f"c.mcap holds no {other.names.color} (ros2.topics.color), {meant}; "
        f"no {other.names.depth} (ros2.topics.depth), {meant}: see --config."
    )
    unplaced = bag(tmp_path / "d.mcap", [entry for entry in drive() if entry[1] != "tf"])
    with pytest.raises(BagError, match=r"holds no /tf \(ros2.namespace\), which must be recorded"):
        list(Ros2Bag(unplaced, CONFIG).frames())
    wrong = bag(tmp_path / "b.mcap", drive(), color="sensor_msgs/msg/Imu")
    with pytest.raises(BagError, match=r"/cam/color .* is sensor_msgs/msg/Imu; it must be"):
        list(Ros2Bag(wrong, CONFIG).frames())


def test_a_bag_that_was_cut_off_says_what_mends_it(tmp_path: Path) -> None:
    path = bag(tmp_path / "a.mcap", drive(4))
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(BagError, match=r"If its recorder was killed, .* or 'mcap recover FILE'"):
        list(Ros2Bag(path, CONFIG).frames())


def test_a_compressed_topic_of_a_robot_with_a_namespace_is_read(tmp_path: Path) -> None:
    topics = {**TOPICS, "color": "/cam/color/compressed"}
    config = Ros2Config.model_validate({"topics": topics, "namespace": "/r1"})
    png = cv2.imencode(".png", np.full((*SIZE, 3), 50, np.uint8))[1].tobytes()
    color = compressed(T0, png, "rgb8; png compressed")
    entries = [(ms, kind, color if kind == "color" else data) for ms, kind, data in drive(1)]
    reader = Ros2Bag(bag(tmp_path / "a.mcap", entries, config), config)
    (frame,) = reader.frames()
    assert np.array_equal(np.unique(frame.rgb), [50])
    with pytest.raises(BagError, match=r"no /tf \(ros2.namespace\), which may be /r1/tf;"):
        list(Ros2Bag(tmp_path / "a.mcap", CONFIG).frames())


def test_own_recordings_need_no_packages_of_ros2() -> None:
    code = (
        "import sys; sys.modules['rosbags'] = None; "
        "import onemap_tools.recording.replay, onemap_tools.recording.bag_file"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_every_form_of_a_bag_gives_the_same_map(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "make_encoder", lambda _: ColourEncoder())
    config, out = tmp_path / "robot.yaml", tmp_path / "flat.npz"
    config.write_text(json.dumps({"ros2": {"topics": TOPICS}}), encoding="utf-8")

    def digest(path: Path) -> str:
        code, document = replayed(path, "--config", str(config), "--out", str(out))
        assert (code, document["frames_fused"], document["reencoded"]) == (0, 4, True)
        assert not document["problems"]
        return str(document["sha256"])

    plain = bag(tmp_path / "a.mcap", drive(4))
    expected = digest(plain)
    assert out.exists()
    for storage, mode in product(StoragePlugin, CompressionMode):
        if (storage, mode) == (StoragePlugin.SQLITE3, CompressionMode.STORAGE):
            continue  # which only MCAP has
        path = rosbag2(tmp_path / f"{storage.name}-{mode.name}", drive(4), storage, mode)
        assert digest(path) == expected, (storage, mode)


def test_bags_that_are_not_read_are_refused_with_what_to_do(tmp_path: Path) -> None:
    folder = rosbag2(tmp_path, drive(1), StoragePlugin.SQLITE3, CompressionMode.FILE)
    metadata = folder / "metadata.yaml"
    said = metadata.read_text(encoding="utf-8")

    def refusal(content: str) -> str:
        metadata.write_text(content, encoding="utf-8")
        result = RUNNER.invoke(app, ["replay", str(folder), "--json"])
        assert result.exit_code == EXIT_USAGE_ERROR
        return str(error_of(result)["error"])

    assert "'lz4' is not supported" in refusal(said.replace("zstd", "lz4", 1))
    assert "cannot be read as a bag of ROS 2" in refusal("[1, 2]")
    assert "files are missing" in refusal(said.replace("bag_1.db3", "bag_9.db3"))
    database = folder / "bag_1.db3.zstd"
    database.write_bytes(zstandard.compress(b"SQLite format 3\0" + bytes(5000)))
    assert "file is not a database" in refusal(said)
    for each in folder.iterdir():
        each.unlink()
    assert "'ros2 bag reindex FOLDER'" in refusal_of(folder)


def refusal_of(path: Path) -> str:
    with pytest.raises(BagError) as error:
        list(Ros2Bag(path, CONFIG).frames())
    return str(error.value)
