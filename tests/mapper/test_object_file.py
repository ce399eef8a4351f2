"""The file of found objects: read after a restart, set aside if it cannot be."""

from __future__ import annotations

from pathlib import Path

import pytest

from onemap_mapper.storage.map_folder import saved_maps
from onemap_mapper.storage.objects import (
    FILE_NAME,
    NO_OBJECTS,
    SET_ASIDE,
    read_objects,
    write_objects,
)
from tests.mapper.finds import object_find

MEMORY = NO_OBJECTS.with_find(object_find("bed"), "00ff00ff")


def test_what_is_written_is_read_and_is_no_map(tmp_path: Path) -> None:
    folder = tmp_path / "maps"
    assert read_objects(folder) == (NO_OBJECTS, "")
    write_objects(folder, MEMORY)
    assert read_objects(folder) == (MEMORY, "")
    assert saved_maps(folder).maps == ()


def test_without_objects_there_is_no_file_and_no_folder(tmp_path: Path) -> None:
    folder = tmp_path / "maps"
    write_objects(folder, NO_OBJECTS)
    assert not folder.exists()
    write_objects(folder, MEMORY)
    write_objects(folder, NO_OBJECTS)
    assert list(folder.iterdir()) == []


def test_an_unreadable_file_is_set_aside(tmp_path: Path) -> None:
    write_objects(tmp_path, MEMORY)
    damaged = (tmp_path / FILE_NAME).read_bytes()[:-8]
    (tmp_path / FILE_NAME).write_bytes(damaged)
    memory, problem = read_objects(tmp_path)
    assert memory == NO_OBJECTS
    assert "the found objects are lost" in problem
    assert f"is now {SET_ASIDE}" in problem
    assert (tmp_path / SET_ASIDE).read_bytes() == damaged
    assert read_objects(tmp_path) == (NO_OBJECTS, "")


def test_a_file_that_cannot_be_renamed_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / FILE_NAME).write_bytes(b"nothing")

    def refuse(*_arguments: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "replace", refuse)
    memory, problem = read_objects(tmp_path)
    assert memory == NO_OBJECTS
    assert problem.endswith("cannot be renamed either: Permission denied")
