"""Found objects: what is the same object, their form on disk, and who answers for them."""

from __future__ import annotations

import logging
from contextlib import suppress
from dataclasses import replace
from itertools import count
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_mapper.storage import objects
from onemap_shared import keys
from onemap_shared.messages import KeptObject, ObjectFind, ObjectId, ObjectListRequest
from onemap_shared.transport import RemoteError
from tests.mapper.finds import PICTURE, object_find
from tests.memory_bus import MemoryRouter


def remembered(*finds: ObjectFind) -> objects.ObjectMemory:
    """The memory after these finds, with ids 0, 1, 2."""
    memory = objects.NO_OBJECTS
    for new_id, find in zip(count(), finds, strict=False):
        memory = memory.with_find(find, str(new_id))
    return memory


def names(memory: objects.ObjectMemory) -> list[str]:
    return [kept.name for kept in memory.listed().objects]


def test_a_find_nearby_is_the_object_seen_again() -> None:
    again = object_find(
        "The  Bed", 0.6, 0.0, stamp_ns=200, search_id="s2", picture=b"new", score=0.7
    )
    memory = remembered(object_find("bed"), object_find("sofa"), again)
    assert names(memory) == ["The Bed", "sofa"]
    kept = memory.listed().objects[0]
    assert (kept.object_id, kept.times_found, kept.search_id) == ("0", 2, "s2")
    assert (kept.position_m, kept.extent_m) == ((0.6, 0.0, 0.4), (-0.4, -1.0, 1.6, 1.0))
    assert (kept.first_found_ns, kept.last_seen_ns, kept.score) == (100, 200, 0.7)
    known = memory.get("0")
    assert known is not None
    assert known.picture == b"new"


finds = st.builds(
    object_find,
    st.sampled_from(["bed", "Sofa", "tea  pot", "Küche"]),
    st.floats(-50, 50),
    st.floats(-50, 50),
    stamp_ns=st.integers(0, 2**63 - 1),
    picture=st.binary(max_size=50),
    box_px=st.sampled_from([(), (0.0, 1.5, 2.0, 3.0)]),
)


@given(st.lists(finds, max_size=8))
def test_what_is_written_is_read(found: list[ObjectFind]) -> None:
    memory = replace(remembered(*found), left_out=7)
    assert objects.from_bytes(objects.to_bytes(memory)) == memory


@given(st.data())
def test_damaged_bytes_are_refused_or_harmless(data: st.DataObject) -> None:
    """Whatever a byte is replaced by: a memory or a ValueError."""
    saved = bytearray(objects.to_bytes(remembered(object_find("bed"), object_find("sofa"))))
    place = data.draw(st.integers(0, len(saved) - 1))
    saved[place] = data.draw(st.integers(0, 255))
    with suppress(ValueError):
        assert len(objects.from_bytes(bytes(saved)).objects) <= 2


def test_pictures_that_do_not_fit_and_ids_used_twice_are_refused() -> None:
    (entry,) = remembered(object_find("bed")).objects
    twice = objects.ObjectMemory((entry, entry))
    with pytest.raises(ValueError, match="same id"):
        objects.to_bytes(twice)
    with pytest.raises(ValueError, match="pictures have 12 bytes, expected 9"):
        objects.to_bytes(
            objects.ObjectMemory((replace(entry, kept=replace(entry.kept, picture_bytes=9)),))
        )
    with pytest.raises(ValueError, match="negative"):
        objects.to_bytes(objects.ObjectMemory(version=-1))


HEIGHT_M = (0.3, 0.7)
WHERE = "in the den"


class Kept:
    """A keeper on a bus, and one who asks it."""

    def __init__(self, folder: Path) -> None:
        router = MemoryRouter()
        bus = router.bus("mapper")
        self.announced: list[int] = []
        self.keeper = objects.ObjectKeeper(
            bus,
            [bus],
            folder,
            self._announce,
            lambda _extent_m: HEIGHT_M,
            tell=lambda finds: [replace(each, where=WHERE) for each in finds],
        )
        self.client = router.bus()

    def _announce(self) -> None:
        self.announced.append(self.keeper.memory.version)

    def remember(self, name: str, x_m: float = 0.0, stamp_ns: int = 100) -> KeptObject:
        find = object_find(name, x_m, stamp_ns=stamp_ns)
        return self.client.call(keys.MAP_REMEMBER, find)

    def names(self) -> list[str]:
        listed = self.client.call(keys.MAP_OBJECTS, ObjectListRequest())
        return [kept.name for kept in listed.objects]


def test_a_find_is_kept_listed_shown_and_forgotten(tmp_path: Path) -> None:
    kept = Kept(tmp_path)
    bed, sofa = kept.remember("bed"), kept.remember("sofa")
    assert len(bed.object_id) == 8
    assert bed.height_m == HEIGHT_M
    assert bed.object_id != sofa.object_id
    assert kept.names() == ["sofa", "bed"]
    shown = kept.client.call(keys.MAP_OBJECT, ObjectId(bed.object_id))
    assert (shown.kept, shown.picture) == (replace(bed, where=WHERE), PICTURE)
    assert {each.kept.where for each in kept.keeper.memory.objects} == {""}  # not kept: it changes
    assert kept.client.call(keys.MAP_FORGET, ObjectId(bed.object_id)) == shown.kept
    assert kept.names() == ["sofa"]
    assert kept.announced == [1, 2, 3]


@pytest.mark.parametrize("procedure", [keys.MAP_OBJECT, keys.MAP_FORGET])
def test_an_unknown_object_is_refused(
    tmp_path: Path, procedure: keys.Procedure[ObjectId, object]
) -> None:
    with pytest.raises(RemoteError, match="no object 'nix'") as refusal:
        Kept(tmp_path).client.call(procedure, ObjectId("nix"))
    assert refusal.value.code == "unknown_object"


def test_objects_survive_a_restart_with_their_version(tmp_path: Path) -> None:
    before = Kept(tmp_path)
    bed = before.remember("bed")
    before.remember("sofa")
    after = Kept(tmp_path)
    assert after.names() == ["sofa", "bed"]
    assert after.keeper.memory == before.keeper.memory
    again = after.remember("bed", 0.5, stamp_ns=300)
    assert (again.object_id, again.times_found) == (bed.object_id, 2)


def replaced(kept: Kept, by: objects.ObjectMemory) -> None:
    kept.keeper.kept.change(lambda memory: memory.changed_to(by))


def test_an_unreadable_file_is_one_sentence_in_the_log(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / objects.FORM.file_name).write_bytes(b"nothing")
    with caplog.at_level(logging.ERROR, "onemap.mapper"):
        kept = Kept(tmp_path)
    assert kept.names() == []
    (record,) = caplog.records
    assert "the found objects are lost" in record.getMessage()


def test_a_find_that_cannot_be_written_is_refused_until_it_can(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The planner sends it again."""
    kept = Kept(tmp_path)

    def full(*_arguments: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("onemap_mapper.storage.kept.replacing", full)
        with pytest.raises(RemoteError, match="No space left on device") as refusal:
            kept.remember("bed")
    assert refusal.value.code == "storage"
    assert kept.names() == []
    assert "cannot write the found objects" in kept.keeper.problem
    kept.remember("bed")
    assert kept.keeper.problem == ""
    assert Kept(tmp_path).names() == ["bed"]
