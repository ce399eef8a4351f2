"""The map survives the mapper: written beside the fusing, resumed by the next one."""

from __future__ import annotations

import dataclasses
import logging
import threading
from collections.abc import Callable
from concurrent.futures import wait
from pathlib import Path

import pytest

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_mapper.storage import checkpoints as checkpoint_file
from onemap_mapper.storage import map_file
from onemap_mapper.storage.checkpoints import Checkpoints, newest, resumed
from onemap_mapper.storage.map_file import LiveMap
from onemap_mapper.storage.snapshot import MapSnapshot, take
from onemap_shared.clock import SystemClock
from tests.mapper import scenes

PARAMS = MapParams()
LATER_S = 1e9  # of the monotonic clock
Writes = Callable[[Path], object]


class Mapped:
    """A map that grows, with its checkpoints."""

    def __init__(self, folder: Path) -> None:
        self.belief = BeliefMap(PARAMS)
        self.lock = threading.Lock()
        live = LiveMap(self.lock, lambda: self.belief)
        self.checkpoints = Checkpoints(folder, live, SystemClock())
        self.now_s = LATER_S

    def see(self, sequence: int) -> None:
        pose = scenes.pose(0.0, 0.0, float(sequence))
        self.belief.fuse(compute_update(scenes.field(sequence, pose), PARAMS))

    def poll(self, after_s: float) -> int:
        """Checkpoints written so far, after this one has ended."""
        self.now_s += after_s
        self.checkpoints.poll(self.now_s)
        if self.checkpoints._writing is not None:
            wait([self.checkpoints._writing])
        return self.checkpoints.written


def cells_of(folder: Path, params: MapParams = PARAMS) -> int:
    belief, _ = resumed(folder, params)
    return 0 if belief is None else belief.store.count


def test_a_changed_map_is_written_after_the_interval(tmp_path: Path) -> None:
    mapped = Mapped(tmp_path)
    assert mapped.poll(0.0) == 0  # an empty map
    mapped.see(0)
    assert mapped.poll(0.0) == 1
    assert cells_of(tmp_path) == mapped.belief.store.count
    mapped.see(1)
    assert mapped.poll(checkpoint_file.INTERVAL_S - 1) == 1
    assert mapped.poll(2.0) == 2
    assert cells_of(tmp_path) == mapped.belief.store.count
    assert mapped.poll(100.0) == 2  # nothing changed
    mapped.belief.reset_searched()
    assert mapped.poll(0.0) == 3


def test_many_changed_cells_are_written_sooner(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkpoint_file, "MANY_CELLS", 100)
    mapped = Mapped(tmp_path)
    mapped.see(0)
    assert mapped.poll(0.0) == 1
    mapped.see(1)
    assert mapped.poll(checkpoint_file.INTERVAL_S / 4) == 1
    assert mapped.poll(checkpoint_file.INTERVAL_S / 6) == 2


def test_a_checkpoint_of_another_grid_is_not_resumed(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    mapped = Mapped(tmp_path)
    mapped.see(0)
    mapped.checkpoints.close()
    assert cells_of(tmp_path, MapParams(cell_size_m=0.2)) == 0
    assert "not resumed: the map has cell size" in caplog.text


def test_a_map_cleared_while_it_is_written_does_not_come_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mapped, write = Mapped(tmp_path), checkpoint_file.write_next

    def cleared_meanwhile(folder: Path, to_file: Writes) -> Path:
        mapped.belief = BeliefMap(PARAMS, first_revision=mapped.belief.revision + 1)
        mapped.checkpoints.replaced(due=False)
        return write(folder, to_file)

    mapped.see(0)
    monkeypatch.setattr(checkpoint_file, "write_next", cleared_meanwhile)
    assert mapped.poll(0.0) == 0
    assert cells_of(tmp_path) == 0


def test_a_loaded_map_is_written_at_once(tmp_path: Path) -> None:
    mapped = Mapped(tmp_path)
    mapped.see(0)
    mapped.poll(0.0)
    mapped.belief = BeliefMap(PARAMS, first_revision=mapped.belief.revision + 1)
    mapped.see(5)
    mapped.checkpoints.replaced(due=True)
    assert cells_of(tmp_path) == 0
    assert mapped.poll(0.0) == 2
    assert cells_of(tmp_path) == mapped.belief.store.count


def test_frames_are_fused_while_a_checkpoint_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mapped, write = Mapped(tmp_path), checkpoint_file.write_next
    writing, go_on = threading.Event(), threading.Event()

    def slow(folder: Path, to_file: Writes) -> Path:
        writing.set()
        assert go_on.wait(60.0)
        return write(folder, to_file)

    monkeypatch.setattr(checkpoint_file, "write_next", slow)
    mapped.see(0)
    mapped.checkpoints.poll(mapped.now_s)
    assert writing.wait(60.0)
    with mapped.lock:
        mapped.see(1)
    mapped.checkpoints.poll(mapped.now_s + 100.0)  # one at a time
    go_on.set()
    mapped.checkpoints.close()
    assert mapped.checkpoints.written == 2
    assert cells_of(tmp_path) == mapped.belief.store.count


def test_what_nobody_expected_ends_the_mapper(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def wrong(_folder: Path, _to_file: Writes) -> Path:
        raise ZeroDivisionError

    mapped = Mapped(tmp_path)
    mapped.see(0)
    monkeypatch.setattr(checkpoint_file, "write_next", wrong)
    mapped.poll(0.0)
    with pytest.raises(ZeroDivisionError):
        mapped.poll(1.0)


def test_a_full_disk_is_said_once_and_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    mapped, write = Mapped(tmp_path), checkpoint_file.write_next

    def full(_folder: Path, _to_file: Writes) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(checkpoint_file, "write_next", full)
    mapped.see(0)
    with caplog.at_level(logging.ERROR):
        mapped.poll(0.0)
        mapped.poll(100.0)
    assert "No space left" in mapped.checkpoints.problem
    assert caplog.text.count("cannot write a checkpoint") == 1
    monkeypatch.setattr(checkpoint_file, "write_next", write)
    assert mapped.poll(100.0) == 1
    assert mapped.checkpoints.problem == ""


@pytest.fixture(scope="module")
def taken() -> MapSnapshot:
    return take(scenes.mapped(scenes.field(0, scenes.pose())))


def write(folder: Path, taken: MapSnapshot) -> Path:
    return checkpoint_file.write_next(folder, lambda path: map_file.write(taken, path))


def numbered(taken: MapSnapshot, frames: int) -> MapSnapshot:
    return dataclasses.replace(taken, header=dataclasses.replace(taken.header, frames_fused=frames))


def frames_of(folder: Path) -> int | None:
    content, _ = newest(folder)
    return None if content is None else content.header.frames_fused


def test_a_damaged_one_leaves_the_one_before(taken: MapSnapshot, tmp_path: Path) -> None:
    write(tmp_path, numbered(taken, 1))
    path = write(tmp_path, numbered(taken, 2))
    path.write_bytes(path.read_bytes()[:1000])
    content, problems = newest(tmp_path)
    assert content is not None
    assert content.header.frames_fused == 1
    assert len(problems) == 1
    assert f"checkpoint {path} cannot be used" in problems[0]
    write(tmp_path, numbered(taken, 3))
    assert frames_of(tmp_path) == 3
