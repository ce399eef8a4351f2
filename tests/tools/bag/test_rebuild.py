"""A map computed from a recording is the recorded one, bit for bit, or it says why not."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import pytest
import torch
from typer.testing import CliRunner

from onemap_mapper.storage import map_file
from onemap_shared import keys
from onemap_shared.keys import Topic
from onemap_shared.messages import (
    AnsweredQuery,
    MapDigest,
    PoseGraph,
    SimilarityRequest,
    Verdict,
)
from onemap_tools.bag import replay as command
from onemap_tools.bag.bag_file import BagReader, BagWriter
from onemap_tools.bag.recorded_topics import DIGESTS, FIELDS, REVISIONS
from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_USAGE_ERROR
from tests.perception.toy import ColourEncoder
from tests.shared.samples import SAMPLES
from tests.tools.bag.bags import RecordedRobot, embedded
from tests.tools.cli.commands import error_of

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


def test_a_map_that_was_cleared_begins_anew(robot: RecordedRobot) -> None:
    robot.see(0, 1)
    robot.update()
    robot.clear()
    robot.see(2)
    assert replayed(robot.end())[1]["frames_fused"] == 1


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


def test_once_the_map_was_cleared_all_is_known(tmp_path: Path) -> None:
    robot = RecordedRobot(tmp_path)
    robot.see(0, 1)
    robot.begin()
    robot.see(2)
    robot.clear()
    robot.see(3)
    code, document = replayed(robot.end())
    assert (code, document["same"], document["problems"]) == (0, True, [])


@pytest.mark.parametrize("topic", [FIELDS.key, REVISIONS.key])
def test_a_missing_message_is_noticed(robot: RecordedRobot, topic: str) -> None:
    robot.see(0, 1, 2)
    code, document = replayed(without(robot.end(), topic, 2))
    assert (code, document["same"]) == (1, None)
    assert "changes of the map are not in the recording" in document["problems"][0]


def test_another_map_is_told(robot: RecordedRobot, monkeypatch: pytest.MonkeyPatch) -> None:
    robot.see(0, 1)
    path = robot.end()
    monkeypatch.setattr("onemap_tools.bag.rebuild.versions", lambda: "torch 99")
    monkeypatch.setattr("onemap_tools.bag.rebuild.sha256_of", lambda _: "00")
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


def test_a_file_that_was_cut_off_is_replayed(robot: RecordedRobot) -> None:
    robot.see(0, 1)
    robot.update()
    robot.writer.sync()
    code, document = replayed(robot.path)
    assert (code, document["cut_off"], document["same"]) == (0, True, True)


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


def test_what_cannot_be_written_is_said(robot: RecordedRobot, tmp_path: Path) -> None:
    robot.see(0)
    (tmp_path / "file").write_text("")
    arguments = ["replay", str(robot.end()), "--out", str(tmp_path / "file" / "a.npz"), "--json"]
    assert "Cannot write" in error_of(RUNNER.invoke(app, arguments))["error"]


def test_what_is_no_recording_is_misuse(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_text("a letter")
    result = RUNNER.invoke(app, ["replay", str(tmp_path / "a.mcap"), "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "is not an MCAP file." in error_of(result)["error"]


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
    assert "this version does not know: smoothing" in error_of(result)["error"]


@pytest.mark.skipif(torch.cuda.is_available(), reason="this machine has a GPU")
def test_without_the_gpu_of_the_recording_the_processor_computes(robot: RecordedRobot) -> None:
    robot.see(0)
    path = with_settings(robot.end(), {"device": "cuda"})
    assert replayed(path)[1]["frames_fused"] == 1


def test_another_encoder_makes_another_map_of_the_images(
    robot: RecordedRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "make_encoder", lambda _: ColourEncoder())
    robot.see(0, 1, 2)
    code, document = replayed(robot.end(), "--reencode")
    assert code == 0
    assert (document["frames_fused"], document["compared"]) == (3, 0)
    assert document["encoder_id"] == ColourEncoder().encoder_id
    assert document["problems"] == []
