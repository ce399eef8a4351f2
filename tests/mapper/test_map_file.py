"""Map files: written and read without loss; everything else is refused."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.frame_update import compute_update
from onemap_mapper.map_file import ARRAYS, map_path, read, write
from onemap_mapper.objects import NO_OBJECTS, to_bytes
from onemap_mapper.params import ObjectParams
from onemap_mapper.snapshot import VERSION, MapFileError, MapSnapshot, restore, take
from tests.mapper import scenes
from tests.mapper.finds import object_find

PARAMS = scenes.params()


@pytest.fixture(scope="module")
def taken() -> MapSnapshot:
    belief = BeliefMap(PARAMS)
    belief.fuse(compute_update(scenes.field(0, scenes.pose(-0.5, 0.2)), PARAMS))
    return take(belief)


def rewritten(path: Path, **changes: Any) -> Path:
    """The same file with arrays replaced; header fields by a dict named ``header``."""
    with np.load(path) as archive:
        content = {name: archive[name] for name in archive.files}
    header = json.loads(str(content["header"])) | changes.pop("header", {})
    content |= {name: array for name, array in changes.items() if array is not None}
    for name in [name for name, array in changes.items() if array is None]:
        del content[name]
    other = path.with_name("other.npz")
    np.savez(other, **(content | {"header": np.array(json.dumps(header))}))
    return other


@pytest.mark.parametrize("dtype", [np.float32, np.float16])
def test_what_is_written_is_read(
    taken: MapSnapshot, tmp_path: Path, dtype: type[np.floating]
) -> None:
    path = tmp_path / "a.npz"
    taken = dataclasses.replace(taken, features=taken.features.astype(dtype))
    assert write(taken, path) == path.stat().st_size
    again = read(path)
    assert again.header == taken.header
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(again, name), getattr(taken, name), strict=True)


def test_found_objects_are_written_with_the_map(taken: MapSnapshot, tmp_path: Path) -> None:
    found = NO_OBJECTS.with_find(object_find("bed"), "00ff00ff", ObjectParams())
    write(dataclasses.replace(taken, objects=found), tmp_path / "a.npz")
    assert read(tmp_path / "a.npz").objects == found
    write(taken, tmp_path / "b.npz")
    assert read(tmp_path / "b.npz").objects == NO_OBJECTS


def test_the_confidence_of_keyframes_is_kept(taken: MapSnapshot, tmp_path: Path) -> None:
    assert taken.explored is not None
    fewer = taken.explored * np.float32(0.25)
    write(dataclasses.replace(taken, explored=fewer), tmp_path / "a.npz")
    np.testing.assert_array_equal(read(tmp_path / "a.npz").explored, fewer)
    for damaged in (np.full_like(taken.explored, np.nan), taken.explored[1:], taken.cells):
        with pytest.raises(MapFileError, match="damaged"):
            read(rewritten(tmp_path / "a.npz", explored=damaged))


def test_a_file_of_a_release_that_counted_all_frames_is_read(
    taken: MapSnapshot, tmp_path: Path
) -> None:
    write(taken, tmp_path / "a.npz")
    old = read(rewritten(tmp_path / "a.npz", explored=None))
    assert old.explored is None
    again = restore(old, PARAMS, encoder_id="", first_revision=1)
    np.testing.assert_array_equal(again.store.explored_confidence, taken.confidence)


def test_damaged_objects_are_refused(taken: MapSnapshot, tmp_path: Path) -> None:
    found = NO_OBJECTS.with_find(object_find("bed"), "00ff00ff", ObjectParams())
    half = np.frombuffer(to_bytes(found)[:-8], np.uint8)
    write(taken, tmp_path / "a.npz")
    for objects in (half, np.zeros(3), np.array("nothing")):
        with pytest.raises(MapFileError, match="damaged"):
            read(rewritten(tmp_path / "a.npz", objects=objects))


def test_names_in_the_file_are_those_of_the_format(taken: MapSnapshot, tmp_path: Path) -> None:
    """Files of earlier releases have them: a renamed field must not change them."""
    write(taken, tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as archive:
        header = json.loads(str(archive["header"]))
        assert set(archive.files) == {
            *("header", "cells", "features", "confidence", "searched", "explored"),
            *("driving_cells", "evidence", "clear"),
        }
    assert set(header) == {
        *("format", "version", "encoder_id", "text_space", "dimension", "cell_size_m"),
        *("obstacle_min_height_m", "obstacle_max_height_m", "frames_fused", "sequence", "stamp_ns"),
    }
    assert (header["format"], header["version"]) == ("onemap-map", 2)


@pytest.mark.parametrize("name", ["a", "a.npz", "A-1_b.c", "x.npz.npz"])
def test_good_names_stay_in_the_folder(name: str) -> None:
    path = map_path(Path("/maps"), name)
    assert path.parent == Path("/maps")
    assert path.suffix == ".npz"


@pytest.mark.parametrize(
    "name",
    ["", ".", "..", "../a", "a/b", "/etc/passwd", "a\\b", ".hidden", "a b", "ä", "a\n", "a\0"],
)
def test_bad_names_are_refused(name: str) -> None:
    with pytest.raises(MapFileError, match="not allowed"):
        map_path(Path("/maps"), name)


def test_a_missing_file_is_reported_by_name(tmp_path: Path) -> None:
    with pytest.raises(MapFileError, match=r"no map gone\.npz"):
        read(tmp_path / "gone.npz")


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_a_truncated_file_is_refused(taken: MapSnapshot, tmp_path: Path, share: float) -> None:
    path = tmp_path / "a.npz"
    size = write(taken, path)
    path.write_bytes(path.read_bytes()[: int(size * share)])
    with pytest.raises(MapFileError, match="damaged"):
        read(path)


def test_a_flipped_byte_is_noticed(taken: MapSnapshot, tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    write(taken, path)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(bytes(content))
    with pytest.raises(MapFileError, match="damaged"):
        read(path)


def test_other_files_are_refused(tmp_path: Path) -> None:
    text, single, foreign = (tmp_path / name for name in ("a.npz", "b.npz", "c.npz"))
    text.write_text("no map")
    with single.open("wb") as file:
        np.save(file, np.zeros(3))
    np.savez(foreign, header=np.array('{"format": "other"}'))
    for path in (text, single, foreign):
        with pytest.raises(MapFileError):
            read(path)


def test_pickles_are_never_read(taken: MapSnapshot, tmp_path: Path) -> None:
    write(taken, tmp_path / "a.npz")
    path = rewritten(tmp_path / "a.npz", cells=np.array([{"a": 1}], dtype=object))
    with pytest.raises(MapFileError, match="damaged"):
        read(path)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"header": {"version": 3}}, "version 3"),
        ({"header": {"version": None}}, "version None"),
        ({"header": {"dimension": 17}}, "features"),
        ({"header": {"frames_fused": "many"}}, "frames_fused"),
        ({"header": {"frames_fused": -1}}, "frames_fused"),
        ({"header": {"extra": 1}}, "damaged"),
        ({"confidence": None}, "damaged"),
        ({"confidence": np.zeros(3, np.float32)}, "confidence"),
        ({"cells": np.zeros((5, 2), np.float64)}, "cells"),
        ({"clear": np.zeros(2, np.uint8)}, "clear"),
        ({"evidence": np.zeros(7, np.int8)}, "evidence"),
    ],
)
def test_a_damaged_file_is_refused(
    taken: MapSnapshot, tmp_path: Path, changes: dict[str, Any], reason: str
) -> None:
    write(taken, tmp_path / "a.npz")
    with pytest.raises(MapFileError, match=reason):
        read(rewritten(tmp_path / "a.npz", **changes))


def test_impossible_values_are_refused(taken: MapSnapshot, tmp_path: Path) -> None:
    write(taken, tmp_path / "a.npz")
    n = len(taken.cells)
    wrong: list[dict[str, np.ndarray]] = [
        {"features": np.full((n, 16), np.nan, np.float32)},
        {"features": np.zeros((n, 16), np.float64)},
        {"confidence": np.full(n, -1, np.float32)},
        {"searched": np.full(n, np.inf, np.float32)},
        {"cells": np.zeros((n, 2), np.int32)},
    ]
    for arrays in wrong:
        with pytest.raises(MapFileError, match="damaged"):
            read(rewritten(tmp_path / "a.npz", **arrays))


def test_a_failed_write_leaves_the_old_file(
    taken: MapSnapshot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.npz"
    write(taken, path)
    before = path.read_bytes()

    def full(*_arguments: object, **_arrays: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(OSError, match="No space"):
        write(taken, path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_an_empty_map_is_written_and_read(tmp_path: Path) -> None:
    write(take(BeliefMap(PARAMS)), tmp_path / "a.npz")
    again = read(tmp_path / "a.npz")
    assert (again.header.encoder_id, len(again.cells), len(again.driving_cells)) == ("", 0, 0)
    assert VERSION == 2


def test_a_map_that_could_not_be_read_is_not_written(taken: MapSnapshot, tmp_path: Path) -> None:
    write(taken, tmp_path / "a.npz")
    before = (tmp_path / "a.npz").read_bytes()
    poisoned = dataclasses.replace(taken, confidence=np.full_like(taken.confidence, np.inf))
    with pytest.raises(MapFileError, match="not finite"):
        write(poisoned, tmp_path / "a.npz")
    assert (tmp_path / "a.npz").read_bytes() == before
