"""Snapshots: what is taken out of a map makes the same map again, and no other fits."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch

from onemap_mapper import snapshot as snapshot_module
from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.frame_update import compute_update
from onemap_mapper.snapshot import (
    EncoderMismatch,
    MapFileError,
    MapSnapshot,
    copied_in_parts,
    restore,
    take,
)
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


def restored(snapshot: MapSnapshot, encoder_id: str = "encoder-a", **changes: object) -> BeliefMap:
    params = scenes.params(**changes)
    return restore(snapshot, params, encoder_id=encoder_id, first_revision=9)


@pytest.mark.parametrize("dtype", ["float32", "float16"])
def test_a_restored_map_is_the_same_map(belief: BeliefMap, dtype: str) -> None:
    if dtype == "float16":
        belief = restored(take(belief), feature_dtype=dtype)
    again = restored(take(belief), feature_dtype=dtype)
    assert (again.encoder_id, again.text_space, again.dimension) == ("encoder-a", "space-a", 16)
    assert (again.frames_fused, again.sequence, again.stamp_ns) == (4, 3, belief.stamp_ns)
    assert again.revision == 9
    slots = again.slots_of(belief.store.cells)
    everything = np.arange(belief.store.count)
    pairs = (
        (again.store.features(slots), belief.store.features(everything)),
        (again.store.confidence[slots], belief.store.confidence),
        (again.store.searched_confidence[slots], belief.store.searched_confidence),
        (again.store.explored_confidence[slots], belief.store.explored_confidence),
    )
    for have, want in pairs:
        torch.testing.assert_close(have, want, atol=0, rtol=0)
    np.testing.assert_array_equal(again.layers(), belief.layers())
    np.testing.assert_array_equal(again.occupancy_grid(), belief.occupancy_grid())


def test_a_restored_map_goes_on_growing(belief: BeliefMap) -> None:
    again = restored(take(belief))
    again.fuse(compute_update(scenes.field(4, scenes.pose(1.0, 1.0, 3.0)), PARAMS))
    assert again.frames_fused == 5


def test_an_empty_map_is_restored_empty() -> None:
    again = restored(take(BeliefMap(PARAMS)))
    assert (again.encoder_id, again.store.count, again.grid.shape) == ("", 0, (0, 0))


def test_a_snapshot_is_detached_from_the_map() -> None:
    made = BeliefMap(PARAMS)
    made.fuse(compute_update(scenes.field(0, scenes.pose()), PARAMS))
    taken = take(made)
    before = taken.features.copy(), taken.confidence.copy(), taken.evidence.copy()
    made.fuse(compute_update(scenes.field(1, scenes.pose()), PARAMS))
    for old, now in zip(before, (taken.features, taken.confidence, taken.evidence), strict=True):
        np.testing.assert_array_equal(old, now)


def test_while_no_encoder_is_known_any_map_is_taken(belief: BeliefMap) -> None:
    assert restored(take(belief), encoder_id="").encoder_id == "encoder-a"


def test_another_encoder_is_refused(belief: BeliefMap) -> None:
    with pytest.raises(EncoderMismatch, match=r"made with encoder encoder-a, but encoder-b"):
        restored(take(belief), encoder_id="encoder-b")


@pytest.mark.parametrize("changes", [{"cell_size_m": 0.2}, {"obstacle_max_height_m": 1.5}])
def test_another_grid_is_refused(belief: BeliefMap, changes: dict[str, Any]) -> None:
    with pytest.raises(MapFileError, match=r"cell size"):
        restored(take(belief), **changes)


def test_a_map_beyond_the_extent_is_refused(belief: BeliefMap) -> None:
    taken = take(belief)
    far = dataclasses.replace(taken, cells=taken.cells + np.int32(10_000))
    with pytest.raises(MapFileError, match=r"larger than max_extent_m"):
        restored(far, max_extent_m=10)


def test_columns_of_another_height_are_refused(belief: BeliefMap) -> None:
    taken = take(belief)
    low = dataclasses.replace(taken, evidence=taken.evidence[:, :3])
    with pytest.raises(MapFileError, match="3 levels"):
        restored(low)


def test_a_file_without_drops_is_still_read(belief: BeliefMap) -> None:
    taken = take(belief)
    header = dataclasses.replace(taken.header, version=1)
    old = dataclasses.replace(taken, header=header, evidence=taken.evidence[:, :-1])
    assert (taken.evidence[:, -1] <= 0).all()
    np.testing.assert_array_equal(restored(old).occupancy_grid(), belief.occupancy_grid())


class Turns:
    """A lock that lets something else happen before it is taken for the n-th time."""

    def __init__(self, happens: dict[int, Callable[[], None]] | None = None) -> None:
        self.taken = 0
        self._happens = happens or {}

    def __enter__(self) -> None:
        self._happens.get(self.taken, lambda: None)()
        self.taken += 1

    def __exit__(self, *_problem: object) -> None: ...


def assert_same_content(one: MapSnapshot | None, two: MapSnapshot) -> None:
    assert one is not None
    assert one.header == two.header
    for field in dataclasses.fields(MapSnapshot):
        if field.name not in ("header", "objects"):
            have, want = getattr(one, field.name), getattr(two, field.name)
            np.testing.assert_array_equal(have, want, strict=True)


@pytest.fixture
def small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(snapshot_module, "PART", 100)


@pytest.mark.usefixtures("small_parts")
@pytest.mark.parametrize("dtype", ["float32", "float16"])
def test_a_copy_in_parts_is_the_map(belief: BeliefMap, dtype: str) -> None:
    belief = restored(take(belief), feature_dtype=dtype)
    lock = Turns()
    assert_same_content(copied_in_parts(lock, lambda: belief), take(belief))
    assert lock.taken > 4  # not as a whole


def test_of_an_empty_map_there_is_no_copy() -> None:
    assert copied_in_parts(Turns(), lambda: BeliefMap(PARAMS)) is None


@pytest.mark.usefixtures("small_parts")
def test_a_frame_that_is_fused_meanwhile_changes_the_rest_of_the_copy(belief: BeliefMap) -> None:
    changing = restored(take(belief))
    update = compute_update(scenes.field(9, scenes.pose()), PARAMS)
    copy = copied_in_parts(Turns({2: lambda: changing.fuse(update)}), lambda: changing)
    assert copy is not None
    count = len(copy.cells)
    np.testing.assert_array_equal(copy.cells, changing.store.cells[:count])
    later = take(changing)
    np.testing.assert_array_equal(copy.features[100:], later.features[100:count])
    np.testing.assert_array_equal(copy.confidence[100:], later.confidence[100:count])
    assert copy.header == take(restored(take(belief))).header


@pytest.mark.usefixtures("small_parts")
def test_cells_that_change_their_slots_meanwhile_begin_the_copy_again(belief: BeliefMap) -> None:
    changing = restored(take(belief))

    def shuffle() -> None:
        store = changing.store
        gone = store.cells[:50].copy()
        changing.slots.values[changing.tiles.rows(gone)] = -1
        refilled = store.remove(np.arange(50), revision=9)
        changing.slots.values[changing.tiles.rows(store.cells[refilled])] = refilled

    copy = copied_in_parts(Turns({2: shuffle}), lambda: changing)
    assert_same_content(copy, take(changing))
    always = Turns(dict.fromkeys(range(100), shuffle))
    assert_same_content(copied_in_parts(always, lambda: changing), take(changing))


@pytest.mark.usefixtures("small_parts")
def test_another_map_meanwhile_is_the_one_that_is_copied(belief: BeliefMap) -> None:
    other = restored(take(belief), cell_size_m=0.1)
    maps = [belief]
    copy = copied_in_parts(Turns({2: lambda: maps.insert(0, other)}), lambda: maps[0])
    assert_same_content(copy, take(other))
