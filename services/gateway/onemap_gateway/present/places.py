"""Places as clients get them, and as GeoJSON."""

from __future__ import annotations

from typing import Any

from onemap.place_replies import MapPlace, PlaceListReply
from onemap_gateway.present.replies import reply_of
from onemap_gateway.present.rooms import map_rooms
from onemap_shared.messages import MapPlaces, polygon_area_m2


def place_list(message: MapPlaces) -> PlaceListReply:
    """The places with their outlines as the map is now."""
    rooms = {room.id: room for room in map_rooms(message.ids, message.grid)}
    places = []
    for place, number in zip(message.places, message.rooms, strict=True):
        known: dict[str, Any] = {"room": None, "outlines_m": (), "area_m2": 0.0}
        if place.corners_m:
            area_m2 = polygon_area_m2(place.corners_m)
            known |= {"outlines_m": (place.corners_m,), "area_m2": area_m2}
        elif room := rooms.get(number):
            known = {"room": room.id, "outlines_m": room.outlines_m, "area_m2": room.area_m2}
        places.append(reply_of(MapPlace, place, **known))
    return PlaceListReply(places=tuple(places), revision=message.revision)


def feature_collection(message: MapPlaces) -> dict[str, Any]:
    """GeoJSON of the places that people named.

    RFC 7946 knows degrees only; the coordinates here are metres of the map frame. A room has its
    outline of now, or is a Point where none is known, and ``inside_m``, by which it is imported.
    """
    features = []
    for place, item in zip(message.places, place_list(message).places, strict=True):
        rings = [[[*outline, outline[0]]] for outline in item.outlines_m]
        properties: dict[str, Any] = {"name": place.name, "kind": place.kind.value}
        geometry: dict[str, Any] = {"type": "Point", "coordinates": place.inside_m}
        if place.corners_m:
            rings = [[[*place.corners_m, place.corners_m[0]]]]  # not rounded
        else:
            properties["inside_m"] = place.inside_m
        if len(rings) == 1:
            geometry = {"type": "Polygon", "coordinates": rings[0]}
        elif rings:
            geometry = {"type": "MultiPolygon", "coordinates": rings}
        if not place.suggested:
            features.append({"type": "Feature", "properties": properties, "geometry": geometry})
    return {"type": "FeatureCollection", "features": features}
