"""ROS 2 bags, as rosbag2 writes them to MCAP."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from typer.testing import CliRunner

from onemap_ros2.config import Ros2Config
from onemap_tools.bag import replay as command
from onemap_tools.bag.bag_file import BagError, BagWriter, is_ros2
from onemap_tools.bag.ros2_frames import Ros2Bag, read_topics
from onemap_tools.cli.app import app
from tests.perception.toy import ColourEncoder
from tests.ros2.robot_messages import camera_info, compressed, image, transforms

T0, MS = 1_700_000_000_000_000_000, 1_000_000
SIZE = (48, 64)
TOPICS = {
    "color": "/cam/color",
    "depth": "/cam/depth",
    "camera_info": "/cam/info",
    "tf": "/robot/tf",
    "tf_static": "/robot/tf_static",
}
CONFIG = Ros2Config.model_validate({"topics": TOPICS})
Entry = tuple[int, str, bytes]  # ms after T0, setting of the topic, message
LEVEL = (0.0, 0.0)


def drive(frames: int = 3, *, tf: bool = True) -> list[Entry]:
    """A camera that moves 0.2 m a frame, which come every 100 ms."""
    entries: list[Entry] = [
        (0, "tf_static", transforms(0, ("base_link", "camera", 0.2, 0.0))),
        (0, "camera_info", camera_info(T0, SIZE[1], SIZE[0], 40.0)),
    ]
    for number in range(frames):
        ms = 100 * number
        rgb = np.full((*SIZE, 3), 50 + number, np.uint8)
        depth = np.full(SIZE, 1500, np.uint16)
        if tf:
            edge = ("map", "base_link", 0.2 * number, 0.0)
            entries.append((ms, "tf", transforms(T0 + ms * MS, edge)))
        entries.append((ms + 1, "color", image(T0 + ms * MS, rgb, "rgb8")))
        entries.append((ms + 2, "depth", image(T0 + ms * MS, depth, "16UC1")))
    return entries


def bag(path: Path, entries: Iterable[Entry], config: Ros2Config = CONFIG, **types: str) -> Path:
    """A file as rosbag2 writes it; ``types``: of topics that are not what they should be."""
    with open(path, "wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="ros2", library="a test")
        channels: dict[str, int] = {}
        for sequence, (ms, kind, data) in enumerate(entries):
            if kind not in channels:
                topic, ros_type = read_topics(config)[kind]
                schema = writer.register_schema(types.get(kind, ros_type), "ros2msg", b"")
                channels[kind] = writer.register_channel(topic, "cdr", schema)
            at_ns = T0 + ms * MS
            writer.add_message(channels[kind], at_ns, data, at_ns, sequence)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def test_frames_have_the_poses_at_their_stamps(tmp_path: Path) -> None:
    path = bag(tmp_path / "a.mcap", drive())
    reader = Ros2Bag(path, CONFIG)
    frames = list(reader.frames())
    assert is_ros2(path)
    assert [frame.stamp_ns for frame in frames] == [T0, T0 + 100 * MS, T0 + 200 * MS]
    assert [frame.rgb[0, 0, 0] for frame in frames] == [50, 51, 52]
    assert [frame.T_map_camera[0, 3] for frame in frames] == pytest.approx([0.2, 0.4, 0.6])
    assert reader.problems == []


def test_a_recording_of_ours_is_no_ros2_bag(tmp_path: Path) -> None:
    BagWriter(tmp_path / "a.mcap", {}).close({})
    assert not is_ros2(tmp_path / "a.mcap")


def test_frames_without_a_transform_are_named(tmp_path: Path) -> None:
    late = [entry for entry in drive(6) if not (entry[1] == "tf" and entry[0] > 200)]
    reader = Ros2Bag(bag(tmp_path / "a.mcap", late), CONFIG)
    assert len(list(reader.frames())) == 3
    assert any("have no transform at their stamp" in problem for problem in reader.problems)


def test_a_topic_that_is_not_there_is_named_with_those_of_its_type(tmp_path: Path) -> None:
    path = bag(tmp_path / "a.mcap", drive())
    other = Ros2Config.model_validate({"topics": {**TOPICS, "depth": "/elsewhere"}})
    with pytest.raises(BagError, match=r"/elsewhere \(ros2.topics.depth\).*/cam/color, /cam/depth"):
        list(Ros2Bag(path, other).frames())


def test_a_topic_of_another_type_is_named(tmp_path: Path) -> None:
    path = bag(tmp_path / "a.mcap", drive(), color="sensor_msgs/msg/CompressedImage")
    with pytest.raises(BagError, match="must be sensor_msgs/msg/Image in cdr"):
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
    with pytest.raises(BagError, match=r"holds no /robot/tf .* those are /r1/robot/tf,"):
        list(Ros2Bag(tmp_path / "a.mcap", CONFIG).frames())


def test_depth_of_a_camera_of_its_own_is_registered(tmp_path: Path) -> None:
    topics = {**TOPICS, "depth_camera_info": "/cam/depth_info"}
    config = Ros2Config.model_validate({"topics": topics})
    own: list[Entry] = [(0, "depth_camera_info", camera_info(T0, SIZE[1], SIZE[0], 40.0))]
    reader = Ros2Bag(bag(tmp_path / "a.mcap", [*own, *drive(2)], config), config)
    assert len(list(reader.frames())) == 2
    without = Ros2Bag(bag(tmp_path / "b.mcap", drive(2)), config)
    with pytest.raises(BagError, match="depth_info"):
        list(without.frames())


def test_own_recordings_need_no_packages_of_ros2() -> None:
    code = (
        "import sys; sys.modules['rosbags'] = None; "
        "import onemap_tools.bag.replay, onemap_tools.bag.bag_file"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_a_bag_of_which_no_frame_can_be_made_says_why(tmp_path: Path) -> None:
    path = bag(tmp_path / "a.mcap", [*drive(2, tf=False), (0, "tf", transforms(0))])
    with pytest.raises(BagError, match=r"no frame in .*map"):
        list(Ros2Bag(path, CONFIG).frames())


def test_replay_makes_a_map_of_a_bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "make_encoder", lambda _: ColourEncoder())
    config, out = tmp_path / "robot.yaml", tmp_path / "flat.npz"
    config.write_text(json.dumps({"ros2": {"topics": TOPICS}}), encoding="utf-8")
    path = bag(tmp_path / "a.mcap", drive())
    arguments = ["replay", str(path), "--config", str(config), "--out", str(out), "--json"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    document: dict[str, Any] = json.loads(result.stdout.splitlines()[-1])
    assert (document["frames_fused"], document["reencoded"]) == (3, True)
    assert document["cells"] > 0
    assert out.exists()


def test_a_bag_whose_topics_are_not_named_is_refused(tmp_path: Path) -> None:
    path = bag(tmp_path / "a.mcap", drive())
    result = CliRunner().invoke(app, ["replay", str(path)])
    assert result.exit_code == 2
    assert "name the topics in --config" in result.stderr
