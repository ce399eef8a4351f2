"""Answers of older and newer gateways, and what a query asks."""

from __future__ import annotations

import pytest

from onemap import Client, OneMapError, QueryOptions, QueryResult
from tests.gateway.fakes import FakeMapper
from tests.shared.samples import PNG


def test_members_that_are_missing_are_empty() -> None:
    result = QueryResult.of({"text": "yeti", "regions": []})
    assert (result.best_score, result.message, result.did_you_mean) == (0.0, "", ())
    assert (result.verdict, result.sentence, result.found) == ("", "", False)
    assert (result.looked.share, result.looked.frontier_m) == (0.0, None)
    old = {"rank": 1, "centre_m": [1, 2], "extent_m": [0, 1, 2, 3], "score": 0.5}
    (region,) = QueryResult.of({"text": "yeti", "regions": [old]}).regions
    assert (region.outline_m, region.last_seen_at, region.best_view) == ((), "", None)
    assert region.height_m is None


def test_members_that_are_new_are_kept() -> None:
    document = {"text": "yeti", "regions": [], "colour": "white"}
    result = QueryResult.of(document)
    assert result.document == document
    assert result == QueryResult.of({"text": "yeti", "regions": []})


def test_a_query_has_a_verdict_and_where_it_was_seen(client: Client, mapper: FakeMapper) -> None:
    result = client.query("sofa")
    assert result.found
    assert result.sentence.startswith("'sofa' is at (0.35, 1.15) m")
    assert (result.looked.share, result.looked.frontier_m) == (0.75, (1.5, 0.5))
    best, second = result.regions
    assert best.outline_m[0] == pytest.approx((0.2, 1.0))
    assert best.best_view == pytest.approx((1.0, 2.0, 0.5))
    assert best.last_seen_at == "2026-01-01T00:00:00.000Z"
    assert (second.best_view, second.last_seen_at) == (None, "")
    assert (best.height_m, second.height_m) == ((0.1, 0.9), None)


def test_negatives_and_area_are_asked_for(client: Client, mapper: FakeMapper) -> None:
    client.query("sofa", negatives=["kettle"], area_m=(0, -1, 2, 3))
    (asked,) = mapper.asked
    assert (asked.negatives, asked.area_m) == (("kettle",), (0.0, -1.0, 2.0, 3.0))


def test_several_texts_have_an_answer_each(client: Client, mapper: FakeMapper) -> None:
    kite, sofa = client.query_all(["kite", "sofa"], QueryOptions(max_regions=1))
    assert (kite.text, kite.verdict) == ("kite", "not_looked_yet")
    assert (sofa.text, len(sofa.regions)) == ("sofa", 1)
    with pytest.raises(OneMapError, match="flurb"):
        client.query_all(["sofa", "flurb"])


def test_what_is_not_asked_for_is_not_sent() -> None:
    assert QueryOptions().body("sofa") == {"text": "sofa", "max_regions": 5}


def test_an_image_is_asked_for(client: Client, mapper: FakeMapper) -> None:
    result = client.query_image(PNG, QueryOptions(max_regions=1, area_m=(0, -1, 2, 3)))
    assert mapper.images == [PNG]
    assert mapper.asked[0].area_m == (0.0, -1.0, 2.0, 3.0)
    assert (result.text, result.calibrated, len(result.regions)) == ("image", False, 1)
    assert client.query("sofa").calibrated
    with pytest.raises(OneMapError, match="no PNG and no JPEG"):
        client.query_image(b"GIF89a")
    assert not QueryResult.of({"text": "yeti", "regions": []}).calibrated
