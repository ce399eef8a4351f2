"""The client: one object for all that a gateway offers."""
# Talks: takes another HTTP transport.

from __future__ import annotations

import os
import ssl
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from types import TracebackType
from typing import Any
from urllib.parse import quote

import httpx

from onemap import replies
from onemap.connection import (
    DEFAULT_URL,
    FILE_TIMEOUT_S,
    TIMEOUT_S,
    Connection,
    InvalidSetting,
    OneMapError,
    Retry,
    Unreachable,
    trusted,
)
from onemap.place_replies import MapPlace, PlaceListReply
from onemap.searches import NO_LIMITS, RemoteSearch, RemoteSearches, SearchLimits

MAPS, OBJECTS, QUERIES = "/v1/maps", "/v1/objects", "/v1/queries"
PLACES = "/v1/places"
Sought = str | Mapping[str, Any]  # a name or sentence, or {"text": "lamp", "near": "bed"}


@dataclass(frozen=True, slots=True)
class QueryOptions:
    """What narrows a query.

    max_regions: best regions of each text; negatives: texts that compete with it; area_m: x_min,
    y_min, x_max, y_max of the part of the map that counts, None for all of it.
    """

    max_regions: int = 5
    negatives: tuple[str, ...] = ()
    area_m: tuple[float, float, float, float] | None = None

    def body(self, asked: Sought | Sequence[Sought] | bytes) -> dict[str, Any]:
        """The body of a request for a text, for several, or for what a PNG or JPEG shows.

        What is not asked for is left out, for older gateways.
        """
        body: dict[str, Any]
        if isinstance(asked, bytes):
            body = {"image": b64encode(asked).decode()}
        elif isinstance(asked, Mapping):
            body = dict(asked)
        else:
            body = {"text": asked} if isinstance(asked, str) else {"texts": [*asked]}
        body["max_regions"] = self.max_regions
        if self.negatives:
            body["negatives"] = list(self.negatives)
        if self.area_m is not None:
            body["area_m"] = list(self.area_m)
        return body


NO_OPTIONS = QueryOptions()


class MapFiles:
    """The robot's map: ``client.maps``. Files lie in the mapper's map folder."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def info(self) -> replies.MapStatistics:
        """Extent, areas and update rate of the map."""
        return self._connection.fetch(replies.MapStatistics.of, "GET", "/v1/map")

    def list(self) -> tuple[replies.StoredMap, ...]:
        """The saved maps, newest first."""
        return self._connection.fetch(replies.MapListReply.of, "GET", MAPS).maps

    def get(self, name: str) -> replies.StoredMap:
        """Size, encoder and time of a saved map."""
        return self._connection.fetch(replies.StoredMap.of, "GET", _address(MAPS, name))

    def save(self, name: str) -> replies.MapContent:
        """Write the map to a file; an older one is replaced."""
        return self._change("PUT", _address(MAPS, name))

    def load(self, name: str) -> replies.MapContent:
        """Replace the map by a saved one; refused if another encoder made it."""
        return self._change("POST", f"{_address(MAPS, name)}/load")

    def merge(
        self, name: str, *, x_m: float = 0.0, y_m: float = 0.0, yaw_rad: float = 0.0
    ) -> replies.MapContent:
        """Fuse a saved map into the map in use: turned by ``yaw_rad``, then moved.

        Its frame is that of the map in use unless a motion is given.
        """
        motion = {"x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad}
        return self._change("POST", f"{_address(MAPS, name)}/merge", motion)

    def delete(self, name: str) -> replies.StoredMap:
        """Delete a file and say what it was; the map in use stays."""
        return self._connection.fetch(replies.StoredMap.of, "DELETE", _address(MAPS, name))

    def clear(self) -> replies.MapContent:
        """Delete the content of the map."""
        return self._connection.fetch(replies.MapContent.of, "POST", "/v1/map/clear")

    def archive(self, text: str = "") -> bytes:
        """Occupancy, layers and geometry of the map, as an ``.npz`` file for ``numpy.load``.

        text: also the similarity of every cell to it.
        """
        path = f"/v1/map.npz?text={quote(text)}" if text else "/v1/map.npz"
        return self._connection.download(path, timeout_s=FILE_TIMEOUT_S)

    def _change(
        self, method: str, path: str, body: dict[str, float] | None = None
    ) -> replies.MapContent:
        return self._connection.fetch(
            replies.MapContent.of, method, path, body, timeout_s=FILE_TIMEOUT_S
        )


class Client:
    """A gateway over HTTP; a context manager. Every failure raises a OneMapError.

    token: the gateway's, if it has one; timeout_s: for one reply; retry: how an interrupted event
    stream is opened again; transport: another one than sockets, for tests; verify: what checks
    certificates of https, by default with the authorities of the file in ``ONEMAP_CA``, or the
    usual ones.
    """

    def __init__(
        self,
        url: str = DEFAULT_URL,
        token: str | None = None,
        timeout_s: float = TIMEOUT_S,
        *,
        retry: Retry | None = None,
        transport: httpx.BaseTransport | None = None,
        verify: ssl.SSLContext | bool | None = None,
    ) -> None:
        checks = trusted(os.environ.get("ONEMAP_CA", "")) if verify is None else verify
        self._connection = Connection(
            url, token or "", timeout_s, transport, retry or Retry(), verify=checks
        )
        self.url = url
        self.searches = RemoteSearches(self._connection)
        self.maps = MapFiles(self._connection)

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the sockets."""
        self._connection.close()

    def query(
        self,
        text: Sought,
        max_regions: int = 5,
        *,
        negatives: Sequence[str] = (),
        area_m: tuple[float, float, float, float] | None = None,
    ) -> replies.QueryResult:
        """Where is it? Whether it is on the map, and regions that look like it, best first.

        text: a name, a sentence as "the lamp next to the bed", or its parts as
        ``{"text": "lamp", "near": "bed"}``; the answer says how it was ``understood``.
        negatives: what it must not be; area_m: x_min, y_min, x_max, y_max, only there.
        """
        body = QueryOptions(max_regions, tuple(negatives), area_m).body(text)
        return self._connection.fetch(replies.QueryResult.of, "POST", QUERIES, body)

    def query_image(self, image: bytes, options: QueryOptions = NO_OPTIONS) -> replies.QueryResult:
        """Where is what a PNG or JPEG of one thing shows? Its scores rank, they are no
        probabilities. The options may have no negatives."""
        return self._connection.fetch(replies.QueryResult.of, "POST", QUERIES, options.body(image))

    def query_all(
        self, texts: Sequence[Sought], options: QueryOptions = NO_OPTIONS
    ) -> tuple[replies.QueryResult, ...]:
        """Where are they? The answers to several texts, in their order."""
        body = options.body(tuple(texts))
        return self._connection.fetch(replies.QueryListReply.of, "POST", QUERIES, body).answers

    def search(
        self,
        objects: Sought | Sequence[Sought],
        *,
        limits: SearchLimits = NO_LIMITS,
        after: str = "stay",
    ) -> RemoteSearch:
        """Go and find: one object, or several, one after the other.

        Each is a name, a sentence, or its parts, as in ``query``. after: ``return`` drives back to
        where the robot set out when all are done, found or not.
        """
        names = [objects] if isinstance(objects, str | Mapping) else [*objects]
        asked = {"objects": names, **({} if after == "stay" else {"after": after})}
        return self.searches.start(asked, limits)

    def places(self) -> PlaceListReply:
        """The places with a name, suggested names, other rooms, and what split and joined."""
        return self._connection.fetch(PlaceListReply.of, "GET", PLACES)

    def name_place(
        self,
        name: str,
        inside_m: tuple[float, float] | None = None,
        *,
        corners_m: Sequence[tuple[float, float]] = (),
        keep_out: bool = False,
    ) -> MapPlace:
        """Name the room that holds a point, or a polygon, or else the room of the robot.

        keep_out: no robot enters it from now on. A place that has the name is replaced.
        """
        body: dict[str, Any] = {"kind": "keep_out" if keep_out else "room"}
        if inside_m is not None:
            body["inside_m"] = _place(*inside_m)
        if corners_m:
            body["corners_m"] = [_place(*corner) for corner in corners_m]
        return self._connection.fetch(MapPlace.of, "PUT", _place_address(name), body)

    def forget_place(self, name: str) -> MapPlace:
        """Remove a place, and say what it was."""
        return self._connection.fetch(MapPlace.of, "DELETE", _place_address(name))

    def forget_places(self) -> PlaceListReply:
        """Remove all places, also those that the mapper cannot read, for which a robot stands."""
        return self._connection.fetch(PlaceListReply.of, "DELETE", PLACES)

    def objects(self) -> list[replies.MapObject]:
        """What was found on this map, the object found last first."""
        return [*self._connection.fetch(replies.ObjectListReply.of, "GET", OBJECTS).objects]

    def object_picture(self, object_id: str) -> bytes:
        """The JPEG in which a found object was seen best."""
        return self._connection.download(f"{_address(OBJECTS, object_id)}.jpg")

    def forget_object(self, object_id: str) -> replies.MapObject:
        """Remove an object that was found wrongly, and say what it was."""
        return self._connection.fetch(replies.MapObject.of, "DELETE", _address(OBJECTS, object_id))

    def go_to(self, x_m: float, y_m: float, *, limits: SearchLimits = NO_LIMITS) -> RemoteSearch:
        """Drive to a place in the map, metres; the search ends as ``arrived`` or ``failed``."""
        return self.searches.start({"go_to_m": _place(x_m, y_m)}, limits)

    def go_to_place(self, name: str, *, limits: SearchLimits = NO_LIMITS) -> RemoteSearch:
        """Drive to a place of the map by its name; ``back``: to where the robot stood when the last
        search or drive was accepted."""
        return self.searches.start({"go_to": name}, limits)

    def look_at(self, x_m: float, y_m: float, *, limits: SearchLimits = NO_LIMITS) -> RemoteSearch:
        """Drive to where a place in the map can be seen, metres, and face it."""
        return self.searches.start({"look_at_m": _place(x_m, y_m)}, limits)

    def status(self) -> replies.SystemStatus:
        """What runs, and how."""
        return self._connection.fetch(replies.SystemStatus.of, "GET", "/v1/status")

    def missing_stage(self) -> str:
        """Why a search cannot start now, in a sentence; empty if it can."""
        try:
            self._connection.download("/readyz")
        except Unreachable:
            return "The gateway does not answer yet."
        except OneMapError as error:
            return error.detail
        return ""


def _address(folder: str, name: str) -> str:
    """The address of a map or an object; InvalidSetting if the name would lead to another one."""
    if not name or "/" in name or name.startswith("."):
        what = "name of a map" if folder == MAPS else "id of an object"
        raise InvalidSetting(
            f"{name!r} is no {what}: it begins with a letter or a digit and has no '/' in it."
        )
    return f"{folder}/{quote(name, safe='')}"


def _place_address(name: str) -> str:
    return f"{PLACES}/{quote(name, safe='')}"


def _place(x_m: float, y_m: float) -> tuple[float, float]:
    if not (isfinite(x_m) and isfinite(y_m)):  # JSON has no such numbers
        raise InvalidSetting(f"({x_m}, {y_m}) is no place: x and y must be finite, in metres.")
    return float(x_m), float(y_m)
