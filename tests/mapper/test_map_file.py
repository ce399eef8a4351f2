"""Maps on disk: what goes in comes out, and nothing else is taken."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from onemap_mapper import snapshot
from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.frame_update import compute_update
from onemap_mapper.map_file import map_path, read, write
from onemap_mapper.snapshot import MapFileError, restore, take
from tests.mapper import scenes

PARAMS = scenes.params()


@pytest.fixture(scope="module")
def belief() -> BeliefMap:
    made = BeliefMap(PARAMS)
    for k in range(3):
        made.fuse(compute_update(scenes.field(k, scenes.pose(-0.5, 0.2, 2.0 * k)), PARAMS))
    made.reset_searched()
    made.fuse(compute_update(scenes.field(3, scenes.pose()), PARAMS))
    return made


def loaded(path: Path, encoder_id: str = "encoder-a", **changes: object) -> BeliefMap:
    params = scenes.params(**changes)
    return restore(read(path), params, encoder_id=encoder_id, first_revision=9)


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


@pytest.mark.parametrize("dtype", ["float32", "float16"])
def test_what_goes_in_comes_out(belief: BeliefMap, tmp_path: Path, dtype: str) -> None:
    path = tmp_path / "a.npz"
    source = belief if dtype == "float32" else loaded_half(belief)
    assert write(take(source), path) == path.stat().st_size
    again = loaded(path, feature_dtype=dtype)
    assert (again.encoder_id, again.text_space, again.dimension) == ("encoder-a", "space-a", 16)
    assert (again.frames_fused, again.sequence, again.stamp_ns) == (4, 3, belief.stamp_ns)
    assert again.revision == 9
    slots = again.slots_of(belief.store.cells)
    everything = np.arange(belief.store.count)
    pairs = (
        (again.store.features(slots), source.store.features(everything)),
        (again.store.confidence[slots], belief.store.confidence),
        (again.store.searched_confidence[slots], belief.store.searched_confidence),
    )
    for have, want in pairs:
        torch.testing.assert_close(have, want, atol=0, rtol=0)
    np.testing.assert_array_equal(again.layers(), belief.layers())
    np.testing.assert_array_equal(again.occupancy_grid(), belief.occupancy_grid())


def loaded_half(belief: BeliefMap) -> BeliefMap:
    params = scenes.params(feature_dtype="float16")
    return restore(take(belief), params, encoder_id="", first_revision=0)


def test_a_loaded_map_goes_on_growing(belief: BeliefMap, tmp_path: Path) -> None:
    write(take(belief), tmp_path / "a.npz")
    again = loaded(tmp_path / "a.npz")
    again.fuse(compute_update(scenes.field(4, scenes.pose(1.0, 1.0, 3.0)), PARAMS))
    assert again.frames_fused == 5


def test_no_encoder_in_use_yet_takes_any_map(belief: BeliefMap, tmp_path: Path) -> None:
    write(take(belief), tmp_path / "a.npz")
    assert loaded(tmp_path / "a.npz", encoder_id="").encoder_id == "encoder-a"


def test_a_snapshot_is_detached_from_the_map() -> None:
    made = BeliefMap(PARAMS)
    made.fuse(compute_update(scenes.field(0, scenes.pose()), PARAMS))
    taken = take(made)
    before = taken.features.copy(), taken.confidence.copy(), taken.evidence.copy()
    made.fuse(compute_update(scenes.field(1, scenes.pose()), PARAMS))
    for old, now in zip(before, (taken.features, taken.confidence, taken.evidence), strict=True):
        np.testing.assert_array_equal(old, now)


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


def test_another_encoder_is_refused(belief: BeliefMap, tmp_path: Path) -> None:
    write(take(belief), tmp_path / "a.npz")
    with pytest.raises(MapFileError, match=r"made with encoder encoder-a, but encoder-b"):
        loaded(tmp_path / "a.npz", encoder_id="encoder-b")


@pytest.mark.parametrize(
    "changes", [{"cell_size_m": 0.2}, {"obstacle_max_height_m": 1.5}, {"max_extent_m": 10}]
)
def test_another_grid_is_refused(
    belief: BeliefMap, tmp_path: Path, changes: dict[str, Any]
) -> None:
    write(take(belief), tmp_path / "a.npz")
    path = tmp_path / "a.npz"
    if "max_extent_m" in changes:
        far = belief.store.cells.astype(np.int32) + 10_000
        path = rewritten(path, cells=far)
    with pytest.raises(MapFileError, match=r"cell size|larger than"):
        loaded(path, **changes)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(MapFileError, match=r"no map gone\.npz"):
        read(tmp_path / "gone.npz")


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_a_truncated_file_is_refused(belief: BeliefMap, tmp_path: Path, share: float) -> None:
    path = tmp_path / "a.npz"
    size = write(take(belief), path)
    path.write_bytes(path.read_bytes()[: int(size * share)])
    with pytest.raises(MapFileError, match="damaged"):
        read(path)


def test_a_flipped_byte_is_noticed(belief: BeliefMap, tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    write(take(belief), path)
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


def test_pickles_are_never_read(belief: BeliefMap, tmp_path: Path) -> None:
    write(take(belief), tmp_path / "a.npz")
    path = rewritten(tmp_path / "a.npz", cells=np.array([{"a": 1}], dtype=object))
    with pytest.raises(MapFileError, match="damaged"):
        read(path)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"header": {"version": 2}}, "version 2"),
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
    belief: BeliefMap, tmp_path: Path, changes: dict[str, Any], reason: str
) -> None:
    write(take(belief), tmp_path / "a.npz")
    with pytest.raises(MapFileError, match=reason):
        read(rewritten(tmp_path / "a.npz", **changes))


def test_impossible_values_are_refused(belief: BeliefMap, tmp_path: Path) -> None:
    write(take(belief), tmp_path / "a.npz")
    n = belief.store.count
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


def test_columns_of_another_height_are_refused(belief: BeliefMap, tmp_path: Path) -> None:
    write(take(belief), tmp_path / "a.npz")
    m = len(take(belief).driving_cells)
    path = rewritten(tmp_path / "a.npz", evidence=np.zeros((m, 3), np.int8))
    with pytest.raises(MapFileError, match="3 levels"):
        loaded(path)


def test_a_failed_write_leaves_the_old_file(
    belief: BeliefMap, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.npz"
    write(take(belief), path)
    before = path.read_bytes()

    def full(*_arguments: object, **_arrays: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(OSError, match="No space"):
        write(take(belief), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_an_empty_map_survives_too(tmp_path: Path) -> None:
    write(take(BeliefMap(PARAMS)), tmp_path / "a.npz")
    again = loaded(tmp_path / "a.npz")
    assert (again.encoder_id, again.store.count, again.grid.shape) == ("", 0, (0, 0))
    assert snapshot.VERSION == 1
