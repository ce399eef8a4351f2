"""A map computed from a recording is the recorded one, bit for bit, or it says why not."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import torch
from mcap.writer import CompressionType, Writer
from typer.testing import CliRunner

from onemap_mapper.storage import map_file
from onemap_ros2.config import Ros2Config
from onemap_shared import keys
from onemap_shared.keys import Topic
from onemap_shared.messages import (
    AnsweredQuery,
    MapDigest,
    MapRevision,
    PoseGraph,
    SimilarityRequest,
    Verdict,
)
from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_USAGE_ERROR
from onemap_tools.recording import replay as command
from onemap_tools.recording.bag_file import (
    DIGESTS,
    FIELDS,
    REVISIONS,
    BagError,
    BagReader,
    BagWriter,
    is_ros2,
)
from onemap_tools.recording.replay import StepKind, map_steps
from onemap_tools.recording.ros2_frames import Ros2Bag, read_topics
from tests.perception.toy import ColourEncoder
from tests.ros2.robot_messages import camera_info, compressed, image, transforms
from tests.shared.samples import SAMPLES
from tests.tools.cli.commands import error_of
from tests.tools.recording.bags import RecordedRobot, embedded

RUNNER = CliRunner()
KINDS: dict[str, Topic[Any]] = {each.key: each for each in (FIELDS, REVISIONS, DIGESTS)}


@pytest.fixture
def robot(tmp_path: Path) -> RecordedRobot:
    made = RecordedRobot(tmp_path)
    made.begin()
    return made


def replayed(path: Path, *options: str) -> tuple[int, dict[str, Any]]:
    result = RUNNER.invoke(app, ["replay", str(path), "--json", *options])
    document: dict[str, Any] = json.loads(result.stdout.splitlines()[-1])
    return result.exit_code, document


def without(path: Path, topic: str, number: int) -> Path:
    """The same bag with the data of all topics but of one message of ``topic``."""
    copy = path.with_name("copy.mcap")
    writer, seen = BagWriter(copy, {}), 0
    for message in BagReader(path).messages():
        seen += message.topic == topic
        if message.topic in KINDS and not (message.topic == topic and seen == number):
            content = message.decode(KINDS[message.topic].message)
            writer.write(message.topic, content, message.log_time_ns)
    writer.close({})
    return copy


def test_queries_are_answered_as_they_were(robot: RecordedRobot) -> None:
    robot.router.bus("perception").serve(keys.EMBED_TEXT, embedded)
    client = robot.router.bus("gateway")
    robot.see(0, 1)
    client.call(keys.MAP_SIMILARITY, SimilarityRequest("sofa"))
    robot.update()
    robot.see(2)
    for area_m in ((), (-3.0, -3.0, 0.0, 3.0)):
        client.call(keys.MAP_SIMILARITY, SimilarityRequest("bed", area_m=area_m))
    code, document = replayed(robot.end())
    assert (code, document["queries"]) == (0, {"compared": 3, "equal": 3})


def test_another_answer_is_noticed(robot: RecordedRobot) -> None:
    robot.router.bus("perception").serve(keys.EMBED_TEXT, embedded)
    client = robot.router.bus("gateway")
    robot.see(0)
    client.call(keys.MAP_SIMILARITY, SimilarityRequest("sofa"))
    query = AnsweredQuery("sofa", 1, 123, "encoder-a", Verdict.FOUND, 0.01)
    unknown = dataclasses.replace(query, text="bed", negatives=("kite",))
    robot.bus.publish(keys.MAP_QUERIES).put(query)
    robot.mapper_bus.publish(keys.MAP_QUERIES).put(dataclasses.replace(unknown, revision=77))
    _, document = replayed(robot.end())
    assert document["queries"] == {"compared": 2, "equal": 1}


def test_the_same_map_bit_for_bit(robot: RecordedRobot) -> None:
    robot.see(0, 1)
    robot.update()
    robot.new_search()
    robot.see(2, fused=False)  # the mapper was busy: it took the newest
    robot.see(3)
    path = robot.end()
    code, document = replayed(path)
    assert (code, document["same"], document["compared"]) == (0, True, 2)
    assert document["frames_fused"] == 3
    assert document["problems"] == []


def test_from_the_middle_of_a_run_nothing_is_compared(tmp_path: Path) -> None:
    robot = RecordedRobot(tmp_path)
    robot.see(0, 1)
    robot.begin()
    robot.see(2)
    path = robot.end()
    code, document = replayed(path)
    assert (code, document["same"], document["frames_fused"]) == (1, None, 1)
    assert "it began with a map that was not empty" in document["problems"][0]
    assert document["problems"][-1] == "No digest of the map could be compared."


@pytest.mark.parametrize("topic", [FIELDS.key, REVISIONS.key])
def test_a_missing_message_is_noticed(robot: RecordedRobot, topic: str) -> None:
    robot.see(0, 1, 2)
    code, document = replayed(without(robot.end(), topic, 2))
    assert (code, document["same"]) == (1, None)
    assert "changes of the map are not in the recording" in document["problems"][0]


def test_another_map_is_told(robot: RecordedRobot, monkeypatch: pytest.MonkeyPatch) -> None:
    robot.see(0, 1)
    path = robot.end()
    monkeypatch.setattr("onemap_tools.recording.replay.versions", lambda: "torch 99")
    monkeypatch.setattr("onemap_tools.recording.replay.sha256_of", lambda _: "00")
    result = RUNNER.invoke(app, ["replay", str(path)])
    assert result.exit_code == 1
    assert "1 of 1 digests differ, first at revision 2" in result.stdout
    assert "computed with torch 99: last bits may differ" in result.stdout


def test_with_corrections_of_slam_nothing_is_compared(robot: RecordedRobot) -> None:
    robot.see(0, 1)
    graph = next(sample for sample in SAMPLES if isinstance(sample, PoseGraph))
    robot.bus.publish(keys.ROBOT_POSE_GRAPH).put(graph)
    code, document = replayed(robot.end())
    assert (code, document["compared"]) == (1, 0)
    assert "corrections of SLAM" in document["problems"][0]


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


def with_settings(path: Path, change: dict[str, Any]) -> Path:
    """The same bag, as if the mapper had been configured otherwise."""
    copy = path.with_name("settings.mcap")
    writer = BagWriter(copy, {})
    for message in BagReader(path).messages():
        if message.topic in KINDS:
            content = message.decode(KINDS[message.topic].message)
            if isinstance(content, MapDigest):
                settings = json.dumps(json.loads(content.settings) | change)
                content = dataclasses.replace(content, settings=settings)
            writer.write(message.topic, content, message.log_time_ns)
    writer.close({})
    return copy


def test_settings_of_another_release_are_named(robot: RecordedRobot) -> None:
    robot.see(0)
    path = with_settings(robot.end(), {"smoothing": 3})
    result = RUNNER.invoke(app, ["replay", str(path), "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "unexpected keyword argument 'smoothing'" in error_of(result)["error"]


@pytest.mark.skipif(torch.cuda.is_available(), reason="this machine has a GPU")
def test_without_the_gpu_of_the_recording_the_processor_computes(robot: RecordedRobot) -> None:
    robot.see(0)
    path = with_settings(robot.end(), {"device": "cuda"})
    assert replayed(path)[1]["frames_fused"] == 1


N, F, R, G = StepKind.NEW_MAP, StepKind.FUSE, StepKind.RESET, StepKind.GAP


def revision(number: int, frames: int) -> MapRevision:
    return MapRevision(number, frames, frames, "a", "b", frames, 10, 100, 1.0, 1.0)


@pytest.mark.parametrize(
    ("announced", "steps"),
    [
        ([], []),
        ([(1, 1), (2, 2)], [N, F, F]),
        ([(0, 0), (1, 1)], [N, N, F]),
        ([(7, 0), (8, 1), (9, 1), (10, 2)], [N, F, R, F]),
        ([(8, 5), (9, 6)], [G, F]),
        ([(8, 5), (9, 0), (10, 1)], [G, N, F]),
        ([(1, 1), (1, 1), (2, 2)], [N, F, F]),
        ([(1, 1), (3, 3)], [N, F, G, F]),
        ([(1, 1), (3, 2)], [N, F, G, F]),
        ([(4, 0), (5, 1), (6, 40)], [N, F, G, F]),
        ([(8, 0), (9, 1), (1, 1), (2, 2)], [N, F, N, F, F]),
        ([(1, 1), (2, 2), (9, 2)], [N, F, F, G]),
    ],
)
def test_steps(announced: list[tuple[int, int]], steps: list[StepKind]) -> None:
    made = list(map_steps(revision(*each) for each in announced))
    assert [step.kind for step in made] == steps


T0, MS = 1_700_000_000_000_000_000, 1_000_000
SIZE = (48, 64)
TOPICS = {
    "color": "/cam/color",
    "depth": "/cam/depth",
    "camera_info": "/cam/info",
}
CONFIG = Ros2Config.model_validate({"topics": TOPICS})
Entry = tuple[int, str, bytes]  # ms after T0, setting of the topic, message


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


def test_a_compressed_topic_of_a_robot_with_a_namespace_is_read(tmp_path: Path) -> None:
    topics = {**TOPICS, "color": "/cam/color/compressed"}
    config = Ros2Config.model_validate({"topics": topics, "namespace": "/r1"})
    png = cv2.imencode(".png", np.full((*SIZE, 3), 50, np.uint8))[1].tobytes()
    color = compressed(T0, png, "rgb8; png compressed")
    entries = [(ms, kind, color if kind == "color" else data) for ms, kind, data in drive(1)]
    reader = Ros2Bag(bag(tmp_path / "a.mcap", entries, config), config)
    (frame,) = reader.frames()
    assert np.array_equal(np.unique(frame.rgb), [50])
    with pytest.raises(BagError, match=r"holds no /tf .* those are /r1/tf,"):
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
        "import onemap_tools.recording.replay, onemap_tools.recording.bag_file"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


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
