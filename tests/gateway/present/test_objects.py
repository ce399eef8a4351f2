"""Found objects as clients get them: rounded, with both forms of a time."""

from __future__ import annotations

from dataclasses import replace

from onemap_gateway.present.objects import (
    MapObjectReport,
    object_list,
    object_report,
    picture_tag,
)
from onemap_shared.messages import ObjectList
from tests.gateway.fakes import STAMP_NS, kept_object


def test_an_object_has_its_place_in_millimetres_and_its_times_twice() -> None:
    kept = replace(kept_object(), position_m=(3.42049, -1.1499, 0.41), last_seen_ns=STAMP_NS + 1)
    assert object_report(kept).model_dump() == {
        "id": "3f9a12c4",
        "name": "bed",
        "position_m": (3.42, -1.15, 0.41),
        "extent_m": (2.5, -2.1, 4.4, -0.3),
        "height_m": (0.1, 0.7),
        "score": 0.93,
        "times_found": 2,
        "search_id": "s1",
        "first_found_at": "2026-01-01T00:00:00.000Z",
        "first_found_ns": "1767225600000000000",
        "last_seen_at": "2026-01-01T00:00:00.000Z",
        "last_seen_ns": "1767225600000000001",
        "box_px": (4.0, 6.0, 20.0, 18.0),
        "picture": "/v1/objects/3f9a12c4.jpg",
    }


def test_an_object_of_an_old_file_has_no_height() -> None:
    assert object_report(replace(kept_object(), height_m=())).height_m is None


def test_the_example_of_the_documentation_is_valid() -> None:
    (example,) = MapObjectReport.model_json_schema()["examples"]
    assert MapObjectReport(**example).model_dump(mode="json") == example


def test_a_list_says_how_many_are_not_kept_any_more() -> None:
    reply = object_list(ObjectList((kept_object(), kept_object("00ff00ff")), 3))
    assert [known.id for known in reply.objects] == ["3f9a12c4", "00ff00ff"]
    assert reply.left_out == 3


def test_another_picture_has_another_tag() -> None:
    kept = kept_object()
    assert picture_tag(kept) == picture_tag(replace(kept, name="sofa"))
    assert picture_tag(kept) != picture_tag(replace(kept, last_seen_ns=1))
    assert picture_tag(kept) != picture_tag(kept_object("00ff00ff"))
