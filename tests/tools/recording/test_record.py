"""What a recorder takes from the bus."""

from __future__ import annotations

import json
import os
import shutil
import signal
import time
from collections import namedtuple
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from typer.testing import CliRunner

from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.transport import Bus, Counters, Subscription
from onemap_tools.cli.app import app
from onemap_tools.recording import record as module
from onemap_tools.recording.bag_file import BagMessage, BagReader, BagWriter
from onemap_tools.recording.record import BagRecorder, subscribed
from onemap_tools.recording.replay import read_history
from tests.gateway import fakes
from tests.mapper import scenes
from tests.tools.cli.commands import error_of
from tests.tools.recording.bags import RecordedRobot, embedded


@pytest.fixture
def robot(tmp_path: Path) -> RecordedRobot:
    made = RecordedRobot(tmp_path)
    made.begin()
    return made


def on(path: Path, key: str) -> list[BagMessage]:
    return [message for message in BagReader(path).messages() if message.topic == key]


def test_what_was_consumed_is_in_the_bag(robot: RecordedRobot) -> None:
    robot.see(0, 1, 2)
    path = robot.end()
    frames = [message.decode(m.RgbdFrame) for message in on(path, "robot/rgbd/v1")]
    fields = [message.decode(m.FeatureField) for message in on(path, "perception/field/v1")]
    revisions = [message.decode(m.MapRevision) for message in on(path, "map/revision/v1")]
    assert [frame.rgb[0, 0, 0] for frame in frames] == [0, 1, 2]
    assert [field.sequence for field in fields] == [0, 1, 2]
    assert [revision.frames_fused for revision in revisions] == [1, 2, 3]
    (digest,) = on(path, "map/digest/v1")
    assert digest.decode(m.MapDigest).frames_fused == 3
    assert robot.recorder.recorded["robot/rgbd/v1"] == 3
    assert robot.recorder.missed == {}


class Emptied:
    """A subscription; something happens once all that it holds is taken."""

    def __init__(self, wrapped: Subscription[Any], then: Callable[[], None]) -> None:
        self._wrapped = wrapped
        self._then = [then]

    def take(self, timeout_s: float) -> Any:
        message = self._wrapped.take(timeout_s)
        if message is None and self._then:
            self._then.pop()()
        return message

    @property
    def counters(self) -> Counters:
        return self._wrapped.counters


def test_no_revision_is_recorded_without_its_features(robot: RecordedRobot) -> None:
    """The last frame arrives and is fused while the recorder goes from topic to topic."""
    bus = robot.router.bus("recorder")
    streams = [
        (topic, Emptied(stream, lambda: robot.see(1)) if topic is keys.FIELD else stream)
        for topic, stream in subscribed(bus, images=True)
    ]
    robot.recorder = BagRecorder(bus, streams, robot.writer)
    robot.see(0)
    path = robot.end()
    fused = {each.stamp_ns for each in on(path, "map/revision/v1")}
    assert fused
    assert fused <= {each.stamp_ns for each in on(path, "perception/field/v1")}


def test_images_can_be_left_out_and_the_mapper_may_be_gone(tmp_path: Path) -> None:
    robot = RecordedRobot(tmp_path, images=False)
    robot.begin()
    robot.see(0, fused=False)
    robot.mapper_bus.close()
    path = robot.end()
    assert on(path, "robot/rgbd/v1") == []
    assert len(on(path, "perception/field/v1")) == 1
    assert "no process serves map/digest/v1" in robot.recorder.problems["map/digest/v1"]


def test_a_snapshot_shows_the_map_and_what_is_sought(robot: RecordedRobot) -> None:
    robot.router.bus("perception").serve(keys.EMBED_TEXT, embedded)
    robot.see(0, 1)
    robot.update()
    robot.bus.publish(keys.SEARCH_STATE).put(fakes.search(objects=("sofa",)))
    empty, sought = (
        message.decode(m.SearchView) for message in on(robot.end(), "map/search_view/v1")
    )
    assert (empty.text, empty.similarity.size) == ("", 0)
    assert sought.text == "sofa"
    assert np.isfinite(sought.similarity).any()
    assert (sought.occupancy != 0).any()


RUNNER = CliRunner()
Usage = namedtuple("Usage", "total used free")


@pytest.fixture
def joined(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RecordedRobot:
    """A robot on the bus that the command joins."""
    made = RecordedRobot(tmp_path)

    @contextmanager
    def session(config: object, name: str, patience_s: float) -> Iterator[Bus]:
        yield made.router.bus(name)

    monkeypatch.setattr(module, "temporary_session", session)
    monkeypatch.setattr(module, "UPDATE_S", 0.001)
    monkeypatch.setattr(module, "SETTLE_S", 0.001)
    return made


def at_a_sync(monkeypatch: pytest.MonkeyPatch, *do: Callable[[], None]) -> None:
    """Do these, one after the other, the first time that the recorder looks at the disk."""
    sync, todo = BagWriter.sync, list(do)

    def synced(writer: BagWriter) -> None:
        sync(writer)
        while todo:
            todo.pop(0)()

    monkeypatch.setattr(BagWriter, "sync", synced)


def stop() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def recorded(path: Path, *options: str) -> Any:
    arguments = ["record", str(path), "--keep-free", "0", "--json", *options]
    return RUNNER.invoke(app, arguments)


def last(result: Any) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(result.stdout.splitlines()[-1])
    return document


def test_ctrl_c_ends_a_recording(
    joined: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config, path = tmp_path / "joined.yaml", tmp_path / "a.mcap"
    config.write_text("gateway: {token: geheim-geheim-geheim}\n")
    at_a_sync(monkeypatch, lambda: joined.see(0, 1), stop)
    result = recorded(path, "--config", str(config))
    assert result.exit_code == 0, result.output
    assert last(result)["messages"]["perception/field/v1"] == 2
    assert "Recording to" in result.stderr
    assert b"geheim" not in path.read_bytes()
    history = read_history(path)
    assert (history.digests[-1].frames_fused, history.cut_off) == (2, False)
    with path.open("rb") as file:
        metadata = {each.name: each.metadata for each in make_reader(file).iter_metadata()}
    assert metadata["end"]["ended"] == "stopped"
    assert len(metadata["onemap"]["configuration_sha256"]) == 64
    path.write_bytes(path.read_bytes()[:-9])
    assert read_history(path).cut_off


def test_features_that_come_after_their_revision_are_waited_for(
    joined: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They travel apart: of the last frame, the map's revision arrives first."""
    late = replace(scenes.field(0, scenes.pose(0.0, 0.0, 0.0)), stamp_ns=fakes.STAMP_NS)
    waited: list[float] = []

    def wait(seconds: float) -> None:
        waited.append(seconds)
        joined.bus.publish(keys.FIELD).put(late)

    monkeypatch.setattr(time, "sleep", wait)
    at_a_sync(
        monkeypatch, lambda: joined.bus.publish(keys.MAP_REVISION).put(fakes.revision(1)), stop
    )
    result = recorded(tmp_path / "a.mcap")
    assert result.exit_code == 0
    assert len(waited) == 1
    assert last(result)["messages"]["perception/field/v1"] == 1


def test_a_map_that_was_not_cleared_is_warned_of(
    joined: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exactly where the replay cannot compare it; a map that was cleared before is new."""
    joined.see(0, 1)
    for name, warned in (("used", True), ("new", False)):
        at_a_sync(monkeypatch, lambda: joined.see(2), stop)
        result = recorded(path := tmp_path / f"{name}.mcap")
        assert ("The map holds 2 frames from before this recording" in result.stderr) is warned
        assert ("map/revision/v1" in last(result)["problems"]) is warned
        assert RUNNER.invoke(app, ["replay", str(path)]).exit_code == int(warned)
        joined.bus.call(keys.MAP_CLEAR, m.MapClear())


def test_the_map_is_cleared_first_or_nothing_is_recorded(
    joined: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    joined.see(0, 1, 2)
    at_a_sync(monkeypatch, lambda: joined.see(3), stop)
    cleared = recorded(tmp_path / "a.mcap", "--clear-map")
    assert (cleared.exit_code, last(cleared)["problems"]) == (0, {})
    assert "frames from before" not in cleared.stderr
    assert read_history(tmp_path / "a.mcap").digests[-1].frames_fused == 1
    joined.mapper_bus.close()
    result = recorded(tmp_path / "b.mcap", "--clear-map")
    assert result.exit_code == 1
    assert "The map was not cleared, so nothing is recorded: no " in error_of(result)["error"]
    assert not (tmp_path / "b.mcap").exists()


def test_a_disk_that_fills_ends_the_recording(
    joined: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(100, 99, 10 * 10**6))
    result = recorded(tmp_path / "a.mcap", "--keep-free", "20")
    assert result.exit_code == 1
    assert "has only 10 MB left and --keep-free asks for 20 MB" in error_of(result)["error"]
    assert error_of(result)["file"] == str(tmp_path / "a.mcap")
    assert not read_history(tmp_path / "a.mcap").cut_off


def test_what_is_missing_is_said(
    joined: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    at_a_sync(
        monkeypatch, lambda: joined.see(0, fused=False), lambda: joined.see(4, fused=False), stop
    )
    result = recorded(tmp_path / "a.mcap")
    assert last(result)["missed"] == {"robot/rgbd/v1": 3}
    assert "3 messages on robot/rgbd/v1 are missing in it." in result.stderr
