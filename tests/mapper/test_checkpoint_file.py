"""The files of checkpoints: the newest that can be read is the one that counts."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.storage import checkpoints as checkpoint_file
from onemap_mapper.storage import map_file
from onemap_mapper.storage.checkpoints import FOLDER, newest, remove_all
from onemap_mapper.storage.map_folder import saved_maps
from onemap_mapper.storage.snapshot import MapSnapshot, take
from tests.mapper import scenes


@pytest.fixture(scope="module")
def taken() -> MapSnapshot:
    belief = BeliefMap(scenes.params())
    belief.fuse(compute_update(scenes.field(0, scenes.pose()), scenes.params()))
    return take(belief)


def write(folder: Path, taken: MapSnapshot) -> Path:
    return checkpoint_file.write_next(folder, lambda path: map_file.write(taken, path))


def numbered(taken: MapSnapshot, frames: int) -> MapSnapshot:
    return dataclasses.replace(taken, header=dataclasses.replace(taken.header, frames_fused=frames))


def frames_of(folder: Path) -> int | None:
    content, _ = newest(folder)
    return None if content is None else content.header.frames_fused


def test_without_a_file_there_is_no_checkpoint(tmp_path: Path) -> None:
    assert newest(tmp_path / "none") == (None, [])


def test_the_newest_of_two_is_read_and_older_ones_go(taken: MapSnapshot, tmp_path: Path) -> None:
    for frames in range(1, 13):
        path = write(tmp_path, numbered(taken, frames))
        assert frames_of(tmp_path) == frames
    assert path.name == "00000012.npz"
    assert len(list((tmp_path / FOLDER).iterdir())) == 2
    assert saved_maps(tmp_path).maps == ()


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


def test_other_files_are_left_alone(taken: MapSnapshot, tmp_path: Path) -> None:
    write(tmp_path, taken)
    other = tmp_path / FOLDER / "mine.npz"
    other.write_bytes(b"mine")
    remove_all(tmp_path)
    assert frames_of(tmp_path) is None
    assert other.read_bytes() == b"mine"
