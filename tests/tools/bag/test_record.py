"""``onemap record`` on a bus in this process: how a recording begins and ends."""

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

import pytest
from typer.testing import CliRunner

from onemap_shared import keys
from onemap_shared.messages import MapClear, MapSummary
from onemap_shared.transport import Bus, RequestRejected
from onemap_tools.bag import record as module
from onemap_tools.bag.bag_file import BagError, BagWriter
from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_USAGE_ERROR
from tests.gateway import fakes
from tests.mapper import scenes
from tests.tools.bag.bags import RecordedRobot
from tests.tools.cli.commands import error_of

RUNNER = CliRunner()
Usage = namedtuple("Usage", "total used free")


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RecordedRobot:
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
    robot: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config, path = tmp_path / "robot.yaml", tmp_path / "a.mcap"
    config.write_text("gateway: {token: geheim-geheim-geheim}\n")
    at_a_sync(monkeypatch, lambda: robot.see(0, 1), stop)
    result = recorded(path, "--config", str(config))
    assert result.exit_code == 0, result.output
    assert last(result)["messages"]["perception/field/v1"] == 2
    assert "Recording to" in result.stderr
    assert b"geheim" not in path.read_bytes()
    shown = RUNNER.invoke(app, ["bag", "info", str(path), "--json"])
    assert shown.exit_code == 0
    assert last(shown)["map"]["frames_fused"] == 2
    assert last(shown)["metadata"]["end"]["ended"] == "stopped"
    assert len(last(shown)["metadata"]["onemap"]["configuration_sha256"]) == 64
    path.write_bytes(path.read_bytes()[:-9])
    assert RUNNER.invoke(app, ["bag", "info", str(path)]).exit_code == 1


def test_features_that_come_after_their_revision_are_waited_for(
    robot: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They travel apart: of the last frame, the map's revision arrives first."""
    late = replace(scenes.field(0, scenes.pose(0.0, 0.0, 0.0)), stamp_ns=fakes.STAMP_NS)
    waited: list[float] = []

    def wait(seconds: float) -> None:
        waited.append(seconds)
        robot.bus.publish(keys.FIELD).put(late)

    monkeypatch.setattr(time, "sleep", wait)
    at_a_sync(
        monkeypatch, lambda: robot.bus.publish(keys.MAP_REVISION).put(fakes.revision(1)), stop
    )
    result = recorded(tmp_path / "a.mcap")
    assert result.exit_code == 0
    assert len(waited) == 1
    assert last(result)["messages"]["perception/field/v1"] == 1


def test_it_ends_after_its_time(robot: RecordedRobot, tmp_path: Path) -> None:
    result = recorded(tmp_path / "a.mcap", "--seconds", "1", "--no-images")
    assert result.exit_code == 0
    assert last(result)["seconds"] >= 1


def test_the_map_is_cleared_first(
    robot: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot.see(0, 1, 2)
    at_a_sync(monkeypatch, lambda: robot.see(3), stop)
    result = recorded(tmp_path / "a.mcap", "--clear-map")
    shown = last(RUNNER.invoke(app, ["bag", "info", str(tmp_path / "a.mcap"), "--json"]))
    assert result.exit_code == 0
    assert shown["map"]["frames_fused"] == 1


def test_a_map_that_is_not_cleared_is_not_recorded(robot: RecordedRobot, tmp_path: Path) -> None:
    def refuse(_: MapClear) -> MapSummary:
        raise RequestRejected("busy", "not now")

    robot.router.bus("mapper").serve(keys.MAP_CLEAR, refuse)
    result = recorded(tmp_path / "a.mcap", "--clear-map")
    assert result.exit_code == 1
    assert "The map was not cleared, so nothing is recorded: not now." in error_of(result)["error"]
    assert not (tmp_path / "a.mcap").exists()


def test_a_disk_that_fills_ends_the_recording(
    robot: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(100, 99, 10 * 10**6))
    result = recorded(tmp_path / "a.mcap", "--keep-free", "20")
    assert result.exit_code == 1
    assert "has only 10 MB left and --keep-free asks for 20 MB" in error_of(result)["error"]
    assert error_of(result)["file"] == str(tmp_path / "a.mcap")
    assert RUNNER.invoke(app, ["bag", "info", str(tmp_path / "a.mcap")]).exit_code == 0


def test_a_write_that_fails_ends_the_recording(
    robot: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail() -> None:
        raise BagError("the recording ended because of a test")

    at_a_sync(monkeypatch, fail)
    result = recorded(tmp_path / "a.mcap")
    assert result.exit_code == 1
    assert error_of(result)["error"] == "The recording ended because of a test."


def test_what_is_there_is_not_overwritten(robot: RecordedRobot, tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_text("mine")
    result = recorded(tmp_path / "a.mcap")
    assert result.exit_code == 1
    assert "did not start" in error_of(result)["error"]


def test_without_a_name_the_time_is_one(
    robot: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    at_a_sync(monkeypatch, stop)
    result = RUNNER.invoke(app, ["record", "--keep-free", "0"])
    assert result.exit_code == 0, result.output
    assert len(list((tmp_path / "runs" / "recordings").glob("*.mcap"))) == 1


def test_what_is_missing_is_said(
    robot: RecordedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    at_a_sync(
        monkeypatch, lambda: robot.see(0, fused=False), lambda: robot.see(4, fused=False), stop
    )
    result = recorded(tmp_path / "a.mcap")
    assert last(result)["missed"] == {"robot/rgbd/v1": 3}
    assert "3 messages on robot/rgbd/v1 are missing in it." in result.stderr


def test_what_is_no_recording_is_misuse(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_text("a letter")
    result = RUNNER.invoke(app, ["bag", "info", str(tmp_path / "a.mcap"), "--json"])
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "is not an MCAP file." in error_of(result)["error"]
