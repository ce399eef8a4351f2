"""Map files: what is written is read, damage is refused, and a changing map is written."""

from __future__ import annotations

import dataclasses
import json
import secrets
import tracemalloc
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.view_log import SeenFrom
from onemap_mapper.frame.update import compute_update
from onemap_mapper.storage import map_file
from onemap_mapper.storage.snapshot import MapFileError, MapSnapshot, restore, take
from onemap_shared.atomic_file import replacing, sweep_leftovers
from tests.mapper import scenes

PARAMS = scenes.params()


@pytest.fixture(scope="module")
def taken() -> MapSnapshot:
    return take(scenes.mapped(scenes.field(0, scenes.pose(-0.5, 0.2))))


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


def test_a_file_without_colours_is_read(taken: MapSnapshot, tmp_path: Path) -> None:
    map_file.write(taken, tmp_path / "a.npz")
    old = map_file.read(rewritten(tmp_path / "a.npz", colours=None))
    assert old.colours is None
    with pytest.raises(MapFileError, match="damaged"):
        map_file.read(rewritten(tmp_path / "a.npz", heights=None))
    again = restore(old, PARAMS, encoder_id="", first_revision=1)
    assert np.isnan(again.store.colours).all()


@pytest.mark.parametrize(
    "name",
    ["", ".", "..", "../a", "a/b", "/etc/passwd", "a\\b", ".hidden", "a b", "ä", "a\n", "a\0"],
)
def test_bad_names_are_refused(name: str) -> None:
    with pytest.raises(MapFileError, match="not allowed"):
        map_file.map_path(Path("/maps"), name)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.999, None])
def test_bytes_that_are_missing_or_changed_are_noticed(
    taken: MapSnapshot, tmp_path: Path, share: float | None
) -> None:
    path = tmp_path / "a.npz"
    content = bytearray(path.read_bytes()) if map_file.write(taken, path) else bytearray()
    if share is None:
        content[len(content) // 2] ^= 0xFF
    path.write_bytes(content if share is None else content[: int(len(content) * share)])
    with pytest.raises(MapFileError, match="damaged"):
        map_file.read(path)


HEADERS: tuple[dict[str, Any], ...] = (
    {"version": 3},
    {"version": "v" * 500},
    {"dimension": 17},
    {"dimension": 2**40},
    {"frames_fused": "many"},
    {"frames_fused": -1},
    {"frames_fused": True},
    {"frames_fused": 2**70},
    {"stamp_ns": 2**63},
    {"cell_size_m": float("nan")},
    {"encoder_id": ""},
    {"encoder_id": "a\ud800"},
    {"encoder_id": "e" * 256},
    {"extra": 1},
)
VALUES = {
    "confidence": (3e38, -1.0, np.nan),
    "searched": (-1.0,),
    "evidence": (13, -5),
    "clear": (3,),
    "driving_cells": (0,),
    "heights": (1.5, np.nan),
    "view_poses": (np.inf,),
    "best_view": (7, -2),
    "view_confidence": (-1.0,),
    "last_seen_ns": (-1,),
}
MAY_BE_MISSING = ("heights",)


@pytest.mark.parametrize("header", HEADERS, ids=str)
def test_a_header_that_no_message_can_hold_is_refused(
    taken: MapSnapshot, tmp_path: Path, header: dict[str, Any]
) -> None:
    map_file.write(taken, tmp_path / "a.npz")
    path = rewritten(tmp_path / "a.npz", header=header)
    alone = () if header == {"dimension": 17} else (map_file.read_header,)  # fits by itself
    for reading in (map_file.read, *alone):
        with pytest.raises(MapFileError) as refused:
            reading(path)
        assert len(str(refused.value)) < 300


@pytest.mark.parametrize("name", VALUES)
def test_an_array_out_of_range_or_of_another_shape_is_refused(
    taken: MapSnapshot, tmp_path: Path, name: str
) -> None:
    map_file.write(taken, tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as archive:
        whole = archive[name]
    other_type = whole.astype(np.int16 if whole.dtype == np.int8 else np.int8)
    damaged = [*(np.full_like(whole, value) for value in VALUES[name]), whole[1:], other_type]
    for array in damaged if name in MAY_BE_MISSING else [*damaged, None]:
        with pytest.raises(MapFileError, match="damaged"):
            map_file.read(rewritten(tmp_path / "a.npz", **{name: array}))


def test_a_map_that_could_not_be_read_is_not_written(taken: MapSnapshot, tmp_path: Path) -> None:
    map_file.write(taken, tmp_path / "a.npz")
    before = (tmp_path / "a.npz").read_bytes()
    poisoned = dataclasses.replace(taken, confidence=np.full_like(taken.confidence, np.inf))
    with pytest.raises(MapFileError, match="outside of 0 to"):
        map_file.write(poisoned, tmp_path / "a.npz")
    assert (tmp_path / "a.npz").read_bytes() == before


def bomb(path: Path, taken: MapSnapshot, cells: int) -> Path:
    """A map whose features are zeros, packed a thousandfold."""
    names = [name for name in map_file.FORMS if name not in map_file.SEEN]
    arrays = {name: getattr(taken, name) for name in names}
    arrays["cells"] = np.argwhere(np.ones((cells, 1), bool)).astype(np.int32)
    arrays["features"] = np.zeros((cells, 16), np.float32)
    arrays |= {name: np.ones(cells, np.float32) for name in ("confidence", "searched")}
    np.savez_compressed(
        path, header=np.array(json.dumps(dataclasses.asdict(taken.header))), **arrays
    )
    return path


def test_a_bomb_is_refused_before_it_is_unpacked(taken: MapSnapshot, tmp_path: Path) -> None:
    path = bomb(tmp_path / "bomb.npz", taken, 1_000_000)
    assert path.stat().st_size < 3_000_000
    tracemalloc.start()
    try:
        with pytest.raises(MapFileError, match="maps are not compressed"):
            map_file.read(path)
        assert tracemalloc.get_traced_memory()[1] < 2_000_000
    finally:
        tracemalloc.stop()


def test_a_failed_write_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")

    def fail() -> None:
        with replacing(path) as file:
            file.write(b"half")
            raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space"):
        fail()
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_under_the_temporary_name_is_not_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    victim, folder = tmp_path / "victim", tmp_path / "maps"
    victim.write_bytes(b"precious")
    folder.mkdir()
    monkeypatch.setattr(secrets, "token_hex", lambda _bytes: "guessed")
    (folder / ".a.bin.guessed.part").symlink_to(victim)
    with pytest.raises(FileExistsError), replacing(folder / "a.bin") as file:
        file.write(b"overwritten")
    assert victim.read_bytes() == b"precious"


def test_leftovers_of_cut_off_writes_are_swept(tmp_path: Path) -> None:
    for name in (".a.npz.12.part", ".b.part", "keep.part", "c.npz"):
        (tmp_path / name).write_bytes(b"x")
    assert sweep_leftovers(tmp_path) == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c.npz", "keep.part"]
    assert sweep_leftovers(tmp_path / "none") == 0


@pytest.fixture(scope="module")
def belief() -> BeliefMap:
    return scenes.mapped(*(scenes.field(k, scenes.pose(-0.5, 0.2, 2.0 * k)) for k in range(3)))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    folder = tmp_path / "maps"
    folder.mkdir()
    return folder / "a.npz"


def restored(belief: BeliefMap, **changes: object) -> BeliefMap:
    params = scenes.params(**changes)
    return restore(take(belief), params, encoder_id="encoder-a", first_revision=9)


class Turns:
    """A lock that lets something else happen before it is taken for the n-th time."""

    def __init__(self, happens: dict[int, Callable[[], None]] | None = None) -> None:
        self.taken = 0
        self._happens = happens or {}

    def __enter__(self) -> None:
        self._happens.get(self.taken, lambda: None)()
        self.taken += 1

    def __exit__(self, *_problem: object) -> None: ...


def assert_same_content(one: MapSnapshot, two: MapSnapshot) -> None:
    assert one.header == two.header
    for field in dataclasses.fields(MapSnapshot):
        if field.name not in ("header", "objects", "seen"):
            have, want = getattr(one, field.name), getattr(two, field.name)
            np.testing.assert_array_equal(have, want, strict=True)
    assert one.seen is not None
    assert two.seen is not None
    for field in dataclasses.fields(SeenFrom):
        have, want = getattr(one.seen, field.name), getattr(two.seen, field.name)
        np.testing.assert_array_equal(have, want, strict=True)


@pytest.fixture
def small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(map_file, "PART", 100)


def written(path: Path, lock: AbstractContextManager[object], current: BeliefMap) -> MapSnapshot:
    """What a file holds that was written of this map."""
    assert map_file.LiveMap(lock, lambda: current).write(path) == path.stat().st_size
    return map_file.read(path)


@pytest.mark.usefixtures("small_parts")
@pytest.mark.parametrize("dtype", ["float32", "float16"])
def test_a_file_in_parts_is_that_of_the_map(belief: BeliefMap, path: Path, dtype: str) -> None:
    belief = restored(belief, feature_dtype=dtype)
    lock = Turns()
    assert_same_content(written(path, lock, belief), take(belief))
    assert lock.taken > 4  # not as a whole


@pytest.mark.usefixtures("small_parts")
def test_a_frame_that_is_fused_meanwhile_changes_the_rest_of_it(
    belief: BeliefMap, path: Path
) -> None:
    changing = restored(belief)
    update = compute_update(scenes.field(9, scenes.pose()), PARAMS)
    copy = written(path, Turns({2: lambda: changing.fuse(update)}), changing)
    count = len(copy.cells)
    np.testing.assert_array_equal(copy.cells, changing.store.cells[:count])
    later = take(changing)
    np.testing.assert_array_equal(copy.features[100:], later.features[100:count])
    np.testing.assert_array_equal(copy.confidence[100:], later.confidence[100:count])
    assert copy.header == take(restored(belief)).header


@pytest.mark.usefixtures("small_parts")
def test_another_map_that_takes_its_place_meanwhile_begins_it_again(
    belief: BeliefMap, path: Path
) -> None:
    maps = [restored(belief), BeliefMap(PARAMS)]
    maps[1].fuse(compute_update(scenes.field(9, scenes.pose()), PARAMS))
    for often in (1, 100):
        turns = Turns(dict.fromkeys(range(2, 2 + often), maps.reverse))
        file = map_file.LiveMap(turns, lambda: maps[0])
        assert file.write(path) == path.stat().st_size
        assert_same_content(map_file.read(path), take(maps[0]))
    assert list(path.parent.iterdir()) == [path]
