"""GeoJSON of regions and objects, checked as RFC 7946 wants it."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from matplotlib.path import Path as Polygon

from onemap import MapObject, QueryResult
from onemap_gateway.present.objects import MapObjectReport
from onemap_gateway.present.queries import QueryReply
from onemap_tools.map_export.geojson import feature_collection

(FOUND, _ABSENT) = QueryReply.model_json_schema()["examples"]
(OBJECT,) = MapObjectReport.model_json_schema()["examples"]


@pytest.fixture
def features() -> list[dict[str, Any]]:
    document = feature_collection([QueryResult.of(FOUND)], [MapObject.of(OBJECT)])
    read: dict[str, Any] = json.loads(json.dumps(document, allow_nan=False))
    assert read["type"] == "FeatureCollection"
    assert all(feature["type"] == "Feature" for feature in read["features"])
    return list(read["features"])


def test_a_region_is_a_closed_polygon_around_its_centre(features: list[dict[str, Any]]) -> None:
    geometry = features[0]["geometry"]
    (ring,) = geometry["coordinates"]
    assert geometry["type"] == "Polygon"
    assert ring[0] == ring[-1]
    x, y = np.array(ring).T
    assert (x[:-1] * y[1:] - x[1:] * y[:-1]).sum() > 0  # counter-clockwise, as the RFC wants it
    assert Polygon(ring).contains_point(FOUND["regions"][0]["centre_m"])
    assert features[0]["properties"]["text"] == "sofa"
    assert features[0]["properties"]["verdict"] == "found"
    assert features[0]["properties"]["height_m"] == [0.1, 0.9]


def test_an_object_is_a_point(features: list[dict[str, Any]]) -> None:
    point = features[1]
    assert point["geometry"] == {"type": "Point", "coordinates": [3.42, -1.15, 0.41]}
    assert (point["id"], point["properties"]["name"]) == ("3f9a12c4", "bed")
    assert point["properties"]["height_m"] == [0.1, 0.7]
    assert point["properties"]["last_seen_at"].startswith("2026-01-01T00:09:51")


def test_a_region_of_an_older_gateway_is_its_box() -> None:
    old = {"rank": 1, "centre_m": [1, 2], "extent_m": [0, 1, 2, 3], "score": 0.5}
    result = QueryResult.of({"text": "bed", "regions": [old]})
    (feature,) = feature_collection([result], [])["features"]
    assert feature["geometry"]["coordinates"] == [[[0, 1], [2, 1], [2, 3], [0, 3], [0, 1]]]
