"""A map is written while it changes: in parts, without a copy of the whole."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.view_log import SeenFrom
from onemap_mapper.frame.update import compute_update
from onemap_mapper.storage import map_file
from onemap_mapper.storage.map_file import LiveMap
from onemap_mapper.storage.snapshot import MapSnapshot, restore, take
from tests.mapper import scenes

PARAMS = scenes.params()


@pytest.fixture(scope="module")
def belief() -> BeliefMap:
    made = BeliefMap(PARAMS)
    for k in range(3):
        made.fuse(compute_update(scenes.field(k, scenes.pose(-0.5, 0.2, 2.0 * k)), PARAMS))
    return made


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
    assert LiveMap(lock, lambda: current).write(path) == path.stat().st_size
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
def test_cells_that_change_their_slots_meanwhile_begin_it_again(
    belief: BeliefMap, path: Path
) -> None:
    changing = restored(belief)

    def shuffle() -> None:
        store = changing.store
        gone = store.cells[:50].copy()
        changing.slots.values[changing.tiles.rows(gone)] = -1
        refilled = store.remove(np.arange(50), revision=9)
        moved = changing.tiles.rows_on_device(store.cells_of(refilled))
        changing.slots.values[moved] = refilled.int()

    assert_same_content(written(path, Turns({2: shuffle}), changing), take(changing))
    always = Turns(dict.fromkeys(range(100), shuffle))
    assert_same_content(written(path, always, changing), take(changing))
    assert list(path.parent.iterdir()) == [path]
