"""Found objects: what is the same object, which are kept, and their form on disk."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from itertools import count

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_mapper.storage import objects
from onemap_mapper.storage.objects import NO_OBJECTS, ObjectMemory, from_bytes, to_bytes
from onemap_shared.messages import ObjectFind
from tests.mapper.finds import object_find


def remembered(*finds: ObjectFind) -> ObjectMemory:
    """The memory after these finds, with ids 0, 1, 2."""
    memory = NO_OBJECTS
    for new_id, find in zip(count(), finds, strict=False):
        memory = memory.with_find(find, str(new_id))
    return memory


def names(memory: ObjectMemory) -> list[str]:
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


def test_the_oldest_makes_room(monkeypatch: pytest.MonkeyPatch) -> None:
    finds = [object_find("chair", 5.0 * n, 0.0) for n in range(4)]
    again = object_find("chair", 5.0, 0.0, stamp_ns=300)  # the second: now the newest
    monkeypatch.setattr(objects, "MAX_OBJECTS", 3)
    memory = remembered(*finds[:3], again, finds[3])
    assert [kept.object_id for kept in memory.listed().objects] == ["4", "1", "2"]
    assert memory.listed().left_out == memory.left_out == 1


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
    assert from_bytes(to_bytes(memory)) == memory


@given(st.data())
def test_damaged_bytes_are_refused_or_harmless(data: st.DataObject) -> None:
    """Whatever a byte is replaced by: a memory or a ValueError."""
    saved = bytearray(to_bytes(remembered(object_find("bed"), object_find("sofa"))))
    place = data.draw(st.integers(0, len(saved) - 1))
    saved[place] = data.draw(st.integers(0, 255))
    with suppress(ValueError):
        assert len(from_bytes(bytes(saved)).objects) <= 2


def test_pictures_that_do_not_fit_and_ids_used_twice_are_refused() -> None:
    (entry,) = remembered(object_find("bed")).objects
    twice = ObjectMemory((entry, entry))
    with pytest.raises(ValueError, match="same id"):
        to_bytes(twice)
    with pytest.raises(ValueError, match="pictures have 12 bytes, expected 9"):
        to_bytes(ObjectMemory((replace(entry, kept=replace(entry.kept, picture_bytes=9)),)))
    with pytest.raises(ValueError, match="negative"):
        to_bytes(ObjectMemory(version=-1))
