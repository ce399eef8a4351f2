"""Bags on disk: what was written is read, however the writer ended."""

from __future__ import annotations

import errno
from pathlib import Path

import numpy as np
import pytest

from onemap_shared.messages import Odometry
from onemap_tools.recording.bag_file import BagError, BagReader, BagWriter
from tests.shared.samples import POSE, SAMPLES, equal

COUNT = 40


def odometry(sequence: int) -> Odometry:
    return Odometry(sequence, 1_000 + sequence, POSE, 0.5, 0.0)


def written(path: Path, *, close: bool = True) -> BagWriter:
    writer = BagWriter(path, {"onemap": {"version": "1"}})
    for k in range(COUNT):
        writer.write("robot/odometry/v1", odometry(k), 5_000 + k)
        if k % 10 == 9:
            writer.sync()
    if close:
        writer.close({"ended": "stopped"})
    return writer


def sequences(path: Path) -> tuple[list[int], BagReader]:
    reader = BagReader(path)
    return [message.sequence for message in reader.messages()], reader


def test_every_message_comes_back(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "all.mcap", {})
    for number, sample in enumerate(SAMPLES):
        writer.write(f"key/{number}", sample, 7 + number)
    writer.close({})
    messages = list(BagReader(tmp_path / "all.mcap").messages())
    assert [(m.topic, m.log_time_ns) for m in messages] == [
        (f"key/{number}", 7 + number) for number in range(len(SAMPLES))
    ]
    for message, sample in zip(messages, SAMPLES, strict=True):
        assert equal(message.decode(type(sample)), sample)
    with pytest.raises(BagError, match=r"on key/1 cannot be read: .*schema"):
        messages[1].decode(type(SAMPLES[0]))


def test_without_its_end_a_file_is_read_up_to_there(tmp_path: Path) -> None:
    whole, path = tmp_path / "whole.mcap", tmp_path / "cut.mcap"
    written(whole)
    content = whole.read_bytes()
    lengths = set()
    for size in range(60, len(content), 97):
        path.write_bytes(content[:size])
        found, reader = sequences(path)
        assert reader.cut_off
        assert found == list(range(len(found)))
        lengths.add(len(found))
    assert lengths == {0, 10, 20, 30, 40}  # chunks are whole or not there


def test_a_recording_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "there.mcap"
    path.write_text("mine")
    with pytest.raises(BagError, match="exists: a recording is not overwritten"):
        BagWriter(path, {})
    assert path.read_text() == "mine"
    with pytest.raises(BagError, match="Cannot write"):
        BagWriter(path / "below" / "a.mcap", {})


class FullDisk:
    """A disk that takes so many bytes, the last write in part."""

    def __init__(self, file: object, room: int) -> None:
        self._file, self._room = file, room

    def write(self, data: memoryview) -> int:
        if self._room == 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        taken: int = self._file.write(data[: self._room])  # type: ignore[attr-defined]
        self._room -= taken
        return taken

    def __getattr__(self, name: str) -> object:
        return getattr(self._file, name)


def write_noise(writer: BagWriter) -> None:
    noise = np.random.default_rng(0)
    for k in range(1000):
        pose = POSE.copy()
        pose[:2, 3] = noise.normal(size=2)
        writer.write("robot/odometry/v1", Odometry(k, k + 1, pose, 0.5, 0.0), k + 1)
        if k % 3 == 2:
            writer.sync()


@pytest.mark.parametrize("room", [0, 100, 2600])
def test_a_full_disk_leaves_what_was_written_before(room: int, tmp_path: Path) -> None:
    path = tmp_path / "full.mcap"
    writer = BagWriter(path, {"onemap": {"version": "1"}})
    writer._output.file = FullDisk(writer._output.file, room)  # type: ignore[assignment]
    with pytest.raises(BagError, match="No space left on device; what was recorded before"):
        write_noise(writer)
    found, reader = sequences(path)
    assert found == list(range(len(found)))
    assert (len(found) > 0) == (room > 1000)
    assert reader.cut_off
    assert path.stat().st_size <= room + 200


def test_what_is_no_mcap_file_or_damaged_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "photo.mcap"
    for content in (b"", b"GIF89a and more of it", b"\x89MCAP0"):
        path.write_bytes(content)
        with pytest.raises(BagError, match="is not an MCAP file"):
            sequences(path)
    with pytest.raises(BagError, match="Cannot read"):
        sequences(tmp_path / "nowhere.mcap")
    written(tmp_path / "damaged.mcap")
    damaged = bytearray((tmp_path / "damaged.mcap").read_bytes())
    damaged[len(damaged) // 4] ^= 0xFF
    path.write_bytes(damaged)
    with pytest.raises(BagError, match="is damaged"):
        sequences(path)
