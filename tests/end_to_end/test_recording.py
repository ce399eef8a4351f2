"""Recordings of real processes: stopped, killed, and with a full disk; and a viewer."""

from __future__ import annotations

import json
import resource
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from onemap_tools.processes.launch import onemap_command
from onemap_tools.recording.bag_file import FIELDS, BagReader
from onemap_tools.recording.replay import ReplayOptions, replay
from tests.end_to_end.system import PATIENCE_S, START_S, System

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]
SERVICES = ("simulator", "perception", "mapper")
SIMULATOR = {"seed": 1, "rgbd_hz": 4.0}
FRAMES = 6  # in a recording, before it ends
SMALL_DISK_BYTES = 3 * 10**6  # a few frames


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """A robot that stands and maps what it sees."""
    folder = tmp_path_factory.mktemp("robot")
    with System(folder, SERVICES, {"simulator": SIMULATOR}) as system:
        system.until(lambda: fused(system) > 1, "frames are fused", START_S)
        yield system


def fused(system: System) -> int:
    revision = system.monitor.revision
    return revision.frames_fused if revision is not None else 0


class Recorder:
    """An ``onemap record`` process."""

    def __init__(self, system: System, path: Path, *, max_bytes: int | None = None) -> None:
        self.path = path
        arguments = ("--config", str(system.configuration), "--keep-free", "0", "--json")
        self.process = subprocess.Popen(
            onemap_command("record", str(path), "--clear-map", *arguments),
            env=system.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stderr is not None
        assert "Recording to" in self.process.stderr.readline()
        if max_bytes is not None:
            resource.prlimit(self.process.pid, resource.RLIMIT_FSIZE, (max_bytes, max_bytes))

    def end(self, signum: int | None) -> tuple[int, str, str]:
        """Exit code and output after this signal, or when it ends by itself."""
        if signum is not None:
            self.process.send_signal(signum)
        out, errors = self.process.communicate(timeout=PATIENCE_S)
        return self.process.returncode, out, errors


def frames_in(path: Path) -> tuple[int, bool]:
    """How many fields it holds, and whether it was cut off."""
    reader = BagReader(path)
    return sum(message.topic == FIELDS.key for message in reader.messages()), reader.cut_off


def recorded(system: System, path: Path) -> Recorder:
    recorder = Recorder(system, path)
    system.until(lambda: 0 < fused(system) < FRAMES, "the map was cleared")
    system.until(lambda: fused(system) >= FRAMES, "frames are fused")
    return recorder


@pytest.mark.parametrize("signum", [signal.SIGINT, signal.SIGTERM])
def test_a_stopped_recorder_leaves_a_complete_file(
    robot: System, tmp_path: Path, signum: int
) -> None:
    path = tmp_path / "stopped.mcap"
    code, out, _ = recorded(robot, path).end(signum)
    assert code == 0
    assert json.loads(out.splitlines()[-1])["bytes"] == path.stat().st_size
    frames, cut_off = frames_in(path)
    assert frames >= FRAMES - 1  # the first field may be of a frame before the recording
    again = replay(ReplayOptions(path))
    assert (again["same"], again["problems"], cut_off) == (True, [], False)


def test_a_killed_recorder_leaves_a_file_that_can_be_read(robot: System, tmp_path: Path) -> None:
    path = tmp_path / "killed.mcap"
    code, _, _ = recorded(robot, path).end(signal.SIGKILL)
    assert code == -signal.SIGKILL
    frames, cut_off = frames_in(path)
    assert cut_off
    assert frames >= FRAMES // 2  # a second of it may be lost


def test_a_full_disk_ends_the_recording_and_not_the_robot(robot: System, tmp_path: Path) -> None:
    path = tmp_path / "full.mcap"
    code, out, errors = Recorder(robot, path, max_bytes=SMALL_DISK_BYTES).end(None)
    assert code == 1
    assert "cannot be written any more: File too large" in errors
    assert "Traceback" not in errors
    assert json.loads(out.splitlines()[-1])["exit_code"] == 1
    assert path.stat().st_size <= SMALL_DISK_BYTES
    assert frames_in(path)[0] > 0
    before = fused(robot)
    robot.until(lambda: fused(robot) > before, "the robot goes on")
