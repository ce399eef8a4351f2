"""Regions and found objects as GeoJSON.

RFC 7946 knows degrees only; the coordinates here are metres of the map frame, which programs take
as they are where no other reference system is set.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from onemap import MapObject, QueryResult


def feature_collection(
    queries: Sequence[QueryResult], objects: Sequence[MapObject]
) -> dict[str, Any]:
    """A Polygon for each region of each answer, and a Point for each found object."""
    regions = [_region(query, index) for query in queries for index in range(len(query.regions))]
    return {"type": "FeatureCollection", "features": [*regions, *map(_object, objects)]}


def _region(query: QueryResult, index: int) -> dict[str, Any]:
    region = query.regions[index]
    x_min, y_min, x_max, y_max = region.extent_m
    box = ((x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max))
    corners = [list(corner) for corner in region.outline_m or box]
    return {
        "type": "Feature",
        "geometry": {"type": "Polygon", "coordinates": [[*corners, corners[0]]]},
        "properties": {
            "kind": "region",
            "text": query.text,
            "verdict": query.verdict,
            "rank": region.rank,
            "score": region.score,
            "variance": region.variance,
            "height_m": list(region.height_m) if region.height_m else None,
            "last_seen_at": region.last_seen_at or None,
        },
    }


def _object(found: MapObject) -> dict[str, Any]:
    return {
        "type": "Feature",
        "id": found.id,
        "geometry": {"type": "Point", "coordinates": list(found.position_m)},
        "properties": {
            "kind": "object",
            "name": found.name,
            "score": found.score,
            "times_found": found.times_found,
            "last_seen_at": found.last_seen_at.isoformat(),
            "extent_m": list(found.extent_m),
            "height_m": list(found.height_m) if found.height_m else None,
        },
    }
