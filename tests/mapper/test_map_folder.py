"""Saved maps are listed as they can be loaded, and deleted; nothing outside the folder is."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.storage.map_file import MapNotFound, map_path, write
from onemap_mapper.storage.map_folder import (
    QuotaExceeded,
    check_quota,
    delete,
    saved_map,
    saved_maps,
)
from onemap_mapper.storage.snapshot import MapSnapshot, take
from tests.mapper import scenes
from tests.mapper.test_map_file import rewritten

PARAMS = scenes.params()


@pytest.fixture(scope="module")
def taken() -> MapSnapshot:
    belief = BeliefMap(PARAMS)
    belief.fuse(compute_update(scenes.field(0, scenes.pose(-0.5, 0.2)), PARAMS))
    return take(belief)


def aged(path: Path, saved_ns: int) -> None:
    os.utime(path, ns=(saved_ns, saved_ns))


def test_a_map_is_described_by_its_header(taken: MapSnapshot, tmp_path: Path) -> None:
    size = write(taken, tmp_path / "flat.npz")
    aged(tmp_path / "flat.npz", 1_767_225_600_000_000_000)
    found = saved_map(tmp_path, "flat")
    assert found == saved_map(tmp_path, "flat.npz")
    assert (found.name, found.file_bytes) == ("flat", size)
    assert found.saved_ns == 1_767_225_600_000_000_000
    assert found.cells_observed == len(taken.cells) > 0
    assert (found.encoder_id, found.text_space) == ("encoder-a", "space-a")
    assert found.cell_size_m == taken.header.cell_size_m
    assert (found.frames_fused, found.problem) == (1, "")


def test_maps_are_listed_newest_first_under_names_that_load(
    taken: MapSnapshot, tmp_path: Path
) -> None:
    for age, name in enumerate(("new.npz", "x.npz.npz", "old.npz")):
        write(taken, tmp_path / name)
        aged(tmp_path / name, (10 - age) * 10**9)
    for other in (".hidden.npz", "a b.npz", "notes.txt"):
        write(taken, tmp_path / other)
    (tmp_path / "folder.npz").mkdir()
    listed = saved_maps(tmp_path)
    assert listed.left_out == 0
    paths = [map_path(tmp_path, each.name).name for each in listed.maps]
    assert paths == ["new.npz", "x.npz.npz", "old.npz"]


def test_damaged_files_are_listed_with_the_reason(taken: MapSnapshot, tmp_path: Path) -> None:
    write(taken, tmp_path / "a.npz")
    rewritten(tmp_path / "a.npz", header={"version": 7}).rename(tmp_path / "newer.npz")
    rewritten(tmp_path / "a.npz", cells=None).rename(tmp_path / "no-cells.npz")
    rewritten(tmp_path / "a.npz", header={"encoder_id": "e" * 999}).rename(tmp_path / "long.npz")
    (tmp_path / "text.npz").write_text("no map")
    with (tmp_path / "array.npz").open("wb") as file:
        np.save(file, np.zeros((3, 2)))
    problems = {each.name: each.problem for each in saved_maps(tmp_path).maps}
    assert problems.pop("a") == ""
    assert "version 7" in problems.pop("newer")
    assert "encoder_id" in problems.pop("long")
    assert set(problems) == {"no-cells", "text", "array"}
    assert all("damaged" in problem for problem in problems.values())


def test_a_deleted_map_is_gone_and_the_others_stay(taken: MapSnapshot, tmp_path: Path) -> None:
    for name in ("a", "b"):
        write(taken, tmp_path / f"{name}.npz")
    assert delete(tmp_path, "a").cells_observed == len(taken.cells)
    assert [each.name for each in saved_maps(tmp_path).maps] == ["b"]
    with pytest.raises(MapNotFound, match=r"no map a\.npz"):
        delete(tmp_path, "a")


def test_saved_maps_may_take_so_much_together(taken: MapSnapshot, tmp_path: Path) -> None:
    size = write(taken, tmp_path / "a.npz")
    check_quota(tmp_path / "b.npz", 10**6 - size, 1)
    with pytest.raises(QuotaExceeded, match="delete one"):
        check_quota(tmp_path / "b.npz", 10**6, 1)
    check_quota(tmp_path / "a.npz", 10**6, 1)  # it is replaced
    check_quota(tmp_path / "none" / "a.npz", 10**6, 1)
    (tmp_path / "gone.npz").symlink_to(tmp_path / "nowhere")
    check_quota(tmp_path / "a.npz", 10**6, 1)
