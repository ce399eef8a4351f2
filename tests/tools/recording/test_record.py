"""What a recorder takes from the bus."""

from __future__ import annotations

import json
import os
import shutil
import signal
from collections import namedtuple
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from typer.testing import CliRunner

from onemap_shared import messages as m
from onemap_shared.transport import Bus
from onemap_tools.cli.app import app
from onemap_tools.recording import record as module
from onemap_tools.recording.bag_file import BagMessage, BagReader, BagWriter
from tests.tools.cli.commands import error_of
from tests.tools.recording.bags import RecordedRobot


@pytest.fixture
def robot(tmp_path: Path) -> RecordedRobot:
    made = RecordedRobot(tmp_path)
    made.begin()
    return made


def is_cut_off(path: Path) -> bool:
    reader = BagReader(path)
    for _ in reader.messages():
        pass
    return reader.cut_off


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
    assert robot.recorder.recorded["robot/rgbd/v1"] == 3
    assert robot.recorder.missed == {}


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
    assert not is_cut_off(path)
    with path.open("rb") as file:
        metadata = {each.name: each.metadata for each in make_reader(file).iter_metadata()}
    assert metadata["end"]["ended"] == "stopped"
    assert len(metadata["onemap"]["configuration_sha256"]) == 64
    path.write_bytes(path.read_bytes()[:-9])
    assert is_cut_off(path)


def test_a_disk_that_fills_ends_the_recording(
    joined: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(100, 99, 10 * 10**6))
    result = recorded(tmp_path / "a.mcap", "--keep-free", "20")
    assert result.exit_code == 1
    assert "has only 10 MB left and --keep-free asks for 20 MB" in error_of(result)["error"]
    assert error_of(result)["file"] == str(tmp_path / "a.mcap")
    assert not is_cut_off(tmp_path / "a.mcap")


def test_what_is_missing_is_said(
    joined: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    at_a_sync(
        monkeypatch, lambda: joined.see(0, fused=False), lambda: joined.see(4, fused=False), stop
    )
    result = recorded(tmp_path / "a.mcap")
    assert last(result)["missed"] == {"robot/rgbd/v1": 3}
    assert "3 messages on robot/rgbd/v1 are missing in it." in result.stderr
