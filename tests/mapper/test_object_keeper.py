"""Found objects on the bus and on disk."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

from onemap_mapper.storage.objects import FILE_NAME, NO_OBJECTS, ObjectKeeper
from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import KeptObject, ObjectId, ObjectListRequest
from onemap_shared.transport import RemoteError
from tests.mapper.finds import PICTURE, object_find

HEIGHT_M = (0.3, 0.7)


class Kept:
    """A keeper on a bus, and one who asks it."""

    def __init__(self, folder: Path) -> None:
        router = MemoryRouter()
        self.announced: list[int] = []
        self.keeper = ObjectKeeper(
            router.bus("mapper"), folder, self._announce, lambda _extent_m: HEIGHT_M
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
    assert (shown.kept, shown.picture) == (bed, PICTURE)
    assert kept.client.call(keys.MAP_FORGET, ObjectId(bed.object_id)) == bed
    assert kept.names() == ["sofa"]
    assert kept.announced == [1, 2, 3]


@pytest.mark.parametrize("procedure", [keys.MAP_OBJECT, keys.MAP_FORGET])
def test_an_unknown_object_is_refused(
    tmp_path: Path, procedure: keys.Procedure[ObjectId, object]
) -> None:
    with pytest.raises(RemoteError, match="no object 'nix'") as refusal:
        Kept(tmp_path).client.call(procedure, ObjectId("nix"))
    assert refusal.value.code == "unknown_object"


def test_a_repeated_find_is_acknowledged_and_not_counted(tmp_path: Path) -> None:
    kept = Kept(tmp_path)
    bed = kept.remember("bed")
    kept.remember("sofa")
    assert kept.remember("bed") == bed
    assert kept.announced == [1, 2]


def test_objects_survive_a_restart_with_their_version(tmp_path: Path) -> None:
    before = Kept(tmp_path)
    bed = before.remember("bed")
    before.remember("sofa")
    after = Kept(tmp_path)
    assert after.names() == ["sofa", "bed"]
    assert after.keeper.memory == before.keeper.memory
    again = after.remember("bed", 0.5, stamp_ns=300)
    assert (again.object_id, again.times_found) == (bed.object_id, 2)


def test_other_objects_take_their_place(tmp_path: Path) -> None:
    kept = Kept(tmp_path)
    kept.keeper.replace(NO_OBJECTS)
    assert kept.announced == []  # as empty as before
    kept.remember("bed")
    other = NO_OBJECTS.with_find(object_find("sofa"), "00ff00ff")
    kept.keeper.replace(other)
    assert kept.names() == Kept(tmp_path).names() == ["sofa"]
    kept.keeper.replace(NO_OBJECTS)
    assert kept.names() == []
    assert not (tmp_path / FILE_NAME).exists()
    assert kept.announced == [1, 2, 3]


def test_an_unreadable_file_is_one_sentence_in_the_log(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / FILE_NAME).write_bytes(b"nothing")
    with caplog.at_level(logging.ERROR, "onemap.mapper"):
        kept = Kept(tmp_path)
    assert kept.names() == []
    (record,) = caplog.records
    assert "the found objects are lost" in record.getMessage()


def test_a_full_disk_is_a_problem_and_no_loss_in_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = Kept(tmp_path)

    def full(*_arguments: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("onemap_mapper.storage.objects.write_objects", full)
        kept.remember("bed")
    assert kept.names() == ["bed"]
    assert "No space left on device; a restart of the mapper loses them" in kept.keeper.problem
    kept.remember("sofa")
    assert kept.keeper.problem == ""
    assert Kept(tmp_path).names() == ["sofa", "bed"]
