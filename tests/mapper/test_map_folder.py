"""The saved maps of a folder: listed, deleted, merged in any order."""

from __future__ import annotations

import os
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.places.memory import PlaceMemory
from onemap_mapper.storage import checkpoints, map_folder, snapshot
from onemap_mapper.storage.map_file import map_path, write
from onemap_mapper.storage.map_folder import QuotaExceeded, check_quota, merged_objects, saved_maps
from onemap_mapper.storage.objects import NO_OBJECTS, ObjectMemory
from onemap_mapper.storage.planar_motion import NO_MOTION, PlanarMotion
from onemap_shared import keys
from onemap_shared.messages import (
    MapFile,
    MapMerge,
    ObjectListRequest,
    PicturedObject,
    Place,
    PlacesChange,
    PlacesRequest,
)
from onemap_shared.transport import RemoteError
from tests.gateway.fakes import kept_object
from tests.mapper import scenes
from tests.mapper.finds import object_find
from tests.mapper.test_map_file import rewritten
from tests.mapper.test_service import ZONE, Rig

PARAMS = scenes.params()


@pytest.fixture(scope="module")
def taken() -> snapshot.MapSnapshot:
    return snapshot.take(scenes.mapped(scenes.field(0, scenes.pose(-0.5, 0.2))))


def aged(path: Path, saved_ns: int) -> None:
    os.utime(path, ns=(saved_ns, saved_ns))


def test_maps_are_listed_newest_first_under_names_that_load(
    taken: snapshot.MapSnapshot, tmp_path: Path
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


def test_damaged_files_are_listed_with_the_reason(
    taken: snapshot.MapSnapshot, tmp_path: Path
) -> None:
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


def test_saved_maps_may_take_so_much_together(taken: snapshot.MapSnapshot, tmp_path: Path) -> None:
    size = write(taken, tmp_path / "a.npz")
    check_quota(tmp_path / "b.npz", 10**6 - size, 1)
    with pytest.raises(QuotaExceeded, match="delete one"):
        check_quota(tmp_path / "b.npz", 10**6, 1)
    check_quota(tmp_path / "a.npz", 10**6, 1)  # it is replaced
    check_quota(tmp_path / "none" / "a.npz", 10**6, 1)
    (tmp_path / "gone.npz").symlink_to(tmp_path / "nowhere")
    check_quota(tmp_path / "a.npz", 10**6, 1)


def test_the_map_before_a_merge_stays_until_the_merged_one_is_written(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.feed(scenes.field(0, scenes.pose()))
    rig.mapper.save(MapFile("flat"))
    rig.mapper._checkpoints.flush()
    (before,) = checkpoints.all_of(tmp_path)
    rig.client.call(keys.MAP_MERGE, MapMerge("flat", x_m=1.0))
    assert checkpoints.all_of(tmp_path) == [before]
    rig.mapper._checkpoints.poll(float("inf"))
    rig.mapper.close()
    merged, _ = checkpoints.resumed(tmp_path, rig.mapper._config.map)
    assert merged is not None
    assert merged.store.count == rig.mapper._map.store.count


def test_what_comes_during_a_merge_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another thread names a zone and keeps a find in the middle of a merge, also a refused one."""
    rig = Rig(tmp_path)
    rig.feed(scenes.field(0, scenes.pose()))
    rig.mapper.save(MapFile("flat"))
    threads: list[threading.Thread] = []

    def meanwhile(procedure: keys.Procedure[Any, Any], request: Any) -> None:
        threads.append(threading.Thread(target=rig.client.call, args=(procedure, request)))
        threads[-1].start()
        threads[-1].join(0.3)  # a merge that lets it in has lost it by now

    def merged_places(
        ours: PlaceMemory, theirs: tuple[Place, ...], moved: PlanarMotion
    ) -> tuple[PlaceMemory, tuple[str, ...]]:
        if len(threads) < 2:
            zone = replace(ZONE, name=f"zone {len(threads)}")
            meanwhile(keys.MAP_CHANGE_PLACES, PlacesChange((zone,)))
        return merge_places(ours, theirs, moved)

    def joined(*parts: Any) -> ObjectMemory:
        meanwhile(keys.MAP_REMEMBER, object_find("bed"))
        return merged_objects(*parts)

    def refusing(*_: object) -> None:
        raise snapshot.MapFileError("it does not fit")

    merge_places = PlaceMemory.merged
    monkeypatch.setattr(PlaceMemory, "merged", merged_places)
    with monkeypatch.context() as refused:
        refused.setattr(map_folder, "merge_into", refusing)
        with pytest.raises(RemoteError, match="it does not fit"):
            rig.client.call(keys.MAP_MERGE, MapMerge("flat"))
    monkeypatch.setattr(map_folder, "merged_objects", joined)
    rig.client.call(keys.MAP_MERGE, MapMerge("flat"))
    for thread in threads:
        thread.join(5.0)
    named = rig.client.call(keys.MAP_PLACES, PlacesRequest()).places
    assert [place.name for place in named if not place.suggested] == ["zone 0", "zone 1"]
    listed = rig.client.call(keys.MAP_OBJECTS, ObjectListRequest())
    assert [kept.name for kept in listed.objects] == ["bed"]


def mapped(pose: tuple[float, float, float], seed: int) -> BeliefMap:
    return scenes.mapped(scenes.field(0, scenes.pose(*pose), seed=seed))


def merged(*maps: snapshot.MapSnapshot, moved: PlanarMotion = NO_MOTION) -> BeliefMap:
    belief = BeliefMap(PARAMS)
    for each in maps:
        snapshot.merge_into(belief, each, moved)
    return belief


def by_cell(belief: BeliefMap) -> dict[tuple[int, int], tuple[np.ndarray, float]]:
    """Feature and confidence of each cell."""
    features = belief.store.features(np.arange(belief.store.count)).numpy()
    confidence = belief.store.confidence
    return {
        (int(x), int(y)): (features[slot], float(confidence[slot]))
        for slot, (x, y) in enumerate(belief.store.cells)
    }


def assert_same(one: BeliefMap, other: BeliefMap) -> None:
    first, second = by_cell(one), by_cell(other)
    assert first.keys() == second.keys()
    for cell, (feature, confidence) in first.items():
        np.testing.assert_allclose(feature, second[cell][0], atol=1e-4)
        assert confidence == pytest.approx(second[cell][1], rel=1e-5)
    a, b = snapshot.take(one), snapshot.take(other)
    order = [np.lexsort(each.driving_cells.T) for each in (a, b)]
    for part in ("driving_cells", "evidence", "clear"):
        np.testing.assert_array_equal(getattr(a, part)[order[0]], getattr(b, part)[order[1]])


@given(seed=st.integers(0, 2**16), x_m=st.floats(-1, 1), yaw_rad=st.floats(-3, 3))
@settings(max_examples=4, deadline=None)
def test_it_does_not_matter_which_map_came_first(seed: int, x_m: float, yaw_rad: float) -> None:
    one = snapshot.take(mapped((0.0, 0.0, 0.0), seed=seed))
    other = snapshot.take(mapped((x_m, 0.3, yaw_rad), seed=seed + 1))
    assert_same(merged(one, other), merged(other, one))


@pytest.mark.parametrize(
    ("changes", "error", "reason"),
    [
        ({"encoder_id": "other-1"}, snapshot.EncoderMismatch, "one encoder"),
        ({"cell_size_m": 0.05}, snapshot.MapFileError, "another cell size"),
    ],
)
def test_what_does_not_fit_changes_nothing(
    changes: dict[str, object], error: type[Exception], reason: str
) -> None:
    belief = mapped((0.0, 0.0, 0.0), seed=0)
    before, revision = snapshot.take(belief), belief.revision
    foreign = replace(before, header=replace(before.header, **changes))  # type: ignore[arg-type]
    with pytest.raises(error, match=reason):
        snapshot.merge_into(belief, foreign, NO_MOTION)
    other = replace(before, evidence=before.evidence[:, 1:])
    with pytest.raises(snapshot.MapFileError, match="levels"):
        snapshot.merge_into(belief, other, NO_MOTION)
    assert belief.revision == revision
    np.testing.assert_array_equal(snapshot.take(belief).features, before.features)


def test_found_objects_are_joined_and_none_is_there_twice() -> None:
    def memory(*kept: object) -> ObjectMemory:
        pictured = tuple(PicturedObject(each, b"") for each in kept)  # type: ignore[arg-type]
        return replace(NO_OBJECTS, objects=pictured)

    bed = replace(kept_object(), picture_bytes=0)  # at (3.42, -1.15)
    same_bed = replace(bed, object_id="a1", position_m=(3.0, -1.0, 0.4))
    lamp = replace(bed, object_id="a2", name="lamp")
    joined = merged_objects(memory(bed), memory(same_bed, lamp), NO_MOTION)
    assert sorted(each.kept.object_id for each in joined.objects) == [bed.object_id, "a2"]
    moved = PlanarMotion(np.pi, 0.0, 0.0)
    (turned,) = merged_objects(NO_OBJECTS, memory(lamp), moved).objects
    np.testing.assert_allclose(turned.kept.position_m, (-3.42, 1.15, 0.41), atol=1e-9)
    np.testing.assert_allclose(turned.kept.extent_m, (-4.4, 0.3, -2.5, 2.1), atol=1e-9)
