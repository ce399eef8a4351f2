"""Found objects of a real gateway."""

from __future__ import annotations

from dataclasses import replace

import pytest

from onemap import Client, InvalidSetting, MapObject, OneMapError
from onemap.map_objects import object_path
from tests.gateway.fakes import PICTURE, STAMP_NS, FakeMapper, kept_object


def test_objects_are_listed_shown_and_forgotten(client: Client, mapper: FakeMapper) -> None:
    blind = replace(kept_object("00ff00ff", "sofa"), box_px=(), picture_bytes=0, height_m=())
    mapper.objects += [kept_object(), blind]
    bed, sofa = client.objects()
    assert (bed.id, bed.name, bed.position_m) == ("3f9a12c4", "bed", (3.42, -1.15, 0.41))
    assert (bed.extent_m, bed.box_px) == ((2.5, -2.1, 4.4, -0.3), (4.0, 6.0, 20.0, 18.0))
    assert (bed.height_m, sofa.height_m) == ((0.1, 0.7), None)
    assert (bed.score, bed.times_found, bed.search_id) == (0.93, 2, "s1")
    assert (bed.first_found_ns, bed.last_seen_ns) == (STAMP_NS, STAMP_NS + 10**9)
    assert bed.last_seen_at.isoformat() == "2026-01-01T00:00:01+00:00"
    assert (bed.has_picture, sofa.has_picture, sofa.box_px) == (True, False, None)
    assert client.object_picture(bed.id) == PICTURE
    assert client.forget_object(bed.id) == bed
    assert client.objects() == [sofa]


def test_an_object_that_is_not_there_is_an_error(client: Client, mapper: FakeMapper) -> None:
    for ask in (client.object_picture, client.forget_object):
        with pytest.raises(OneMapError, match="'nix'") as error:
            ask("nix")
        assert error.value.status == 404


@pytest.mark.parametrize("object_id", ["", "..", "a/b"])
def test_an_id_that_would_be_another_address_is_not_sent(object_id: str) -> None:
    with pytest.raises(InvalidSetting, match="no id of an object"):
        object_path(object_id)


def test_members_that_are_new_are_kept() -> None:
    document = {
        "id": "3f9a12c4",
        "name": "bed",
        "position_m": [1, 2, 0],
        "extent_m": [0, 1, 2, 3],
        "score": 1,
        "times_found": 1,
        "first_found_ns": "1767225612400000001",
        "last_seen_ns": "1767225612400000001",
        "colour": "white",
    }
    found = MapObject.of(document)
    assert found.document == document
    assert found.last_seen_ns == 1767225612400000001
    assert (found.search_id, found.box_px, found.has_picture) == ("", None, False)
