"""The client: one object for all that a gateway offers."""
# Talks: takes another HTTP transport.

from __future__ import annotations

from collections.abc import Iterator, Sequence
from types import TracebackType

import httpx

from onemap.connection import DEFAULT_URL, TIMEOUT_S, Connection
from onemap.errors import OneMapError, Unreachable
from onemap.map_files import MapFiles
from onemap.map_objects import ADDRESS, MapObject, object_path
from onemap.queries import NO_OPTIONS, QueryOptions, QueryResult
from onemap.remote_search import NO_LIMITS, RemoteSearch, RemoteSearches, Retry, SearchLimits
from onemap.replies import SystemStatus
from onemap.standing_queries import QueryEvent, StandingQueries


class Client:
    """A gateway over HTTP; a context manager. Every failure raises a OneMapError.

    token: the gateway's, if it has one; timeout_s: for one reply; retry: how an interrupted event
    stream is opened again; transport: another one than sockets, for tests.
    """

    def __init__(
        self,
        url: str = DEFAULT_URL,
        token: str | None = None,
        timeout_s: float = TIMEOUT_S,
        *,
        retry: Retry | None = None,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        self._connection = Connection(url, token or "", timeout_s, transport)
        self.url = url
        self.searches = RemoteSearches(self._connection, retry or Retry())
        self._standing = StandingQueries(self._connection, retry or Retry())
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
        text: str,
        max_regions: int = 5,
        *,
        negatives: Sequence[str] = (),
        area_m: tuple[float, float, float, float] | None = None,
    ) -> QueryResult:
        """Where is it? Whether it is on the map, and regions that look like it, best first.

        negatives: what it must not be; area_m: x_min, y_min, x_max, y_max, only there.
        """
        options = QueryOptions(max_regions, tuple(negatives), area_m)
        body = options.body(text)
        return self._connection.fetch(QueryResult.of, "POST", "/v1/queries", body)

    def query_image(self, image: bytes, options: QueryOptions = NO_OPTIONS) -> QueryResult:
        """Where is what a PNG or JPEG of one thing shows? Its scores rank, they are no
        probabilities. The options may have no negatives."""
        body = options.image_body(image)
        return self._connection.fetch(QueryResult.of, "POST", "/v1/queries", body)

    def query_all(
        self, texts: Sequence[str], options: QueryOptions = NO_OPTIONS
    ) -> tuple[QueryResult, ...]:
        """Where are they? The answers to several texts, in their order."""
        body = options.body(tuple(texts))
        return self._connection.fetch(QueryResult.all_of, "POST", "/v1/queries", body)

    def follow_queries(
        self, texts: Sequence[str], options: QueryOptions = NO_OPTIONS
    ) -> Iterator[QueryEvent]:
        """Standing queries: the answer to each text, and again whenever it changes, without end."""
        return self._standing.events(tuple(texts), options)

    def follow_image(
        self, image: bytes, options: QueryOptions = NO_OPTIONS
    ) -> Iterator[QueryEvent]:
        """The same for what a PNG or JPEG of one thing shows, as of ``query_image``."""
        return self._standing.image_events(image, options)

    def search(
        self,
        objects: str | Sequence[str],
        *,
        any_order: bool = False,
        limits: SearchLimits = NO_LIMITS,
    ) -> RemoteSearch:
        """Go and find: one object, or several, one after the other.

        any_order: the robot takes the cheapest order by what its map shows, and revises it; the
        results are in the order of ``objects`` all the same.
        """
        names = (objects,) if isinstance(objects, str) else tuple(objects)
        return self.searches.start(names, any_order=any_order, limits=limits)

    def objects(self) -> list[MapObject]:
        """What was found on this map, the object found last first."""
        return self._connection.fetch(
            lambda document: list(map(MapObject.of, document["objects"])), "GET", ADDRESS
        )

    def object_picture(self, object_id: str) -> bytes:
        """The JPEG in which a found object was seen best."""
        return self._connection.download(f"{object_path(object_id)}.jpg")

    def forget_object(self, object_id: str) -> MapObject:
        """Remove an object that was found wrongly, and say what it was."""
        return self._connection.fetch(MapObject.of, "DELETE", object_path(object_id))

    def go_to(self, x_m: float, y_m: float, *, limits: SearchLimits = NO_LIMITS) -> RemoteSearch:
        """Drive to a place in the map, metres; the search ends as ``arrived`` or ``failed``."""
        return self.searches.go_to(x_m, y_m, limits=limits)

    def look_at(self, x_m: float, y_m: float, *, limits: SearchLimits = NO_LIMITS) -> RemoteSearch:
        """Drive to where a place in the map can be seen, metres, and face it."""
        return self.searches.look_at(x_m, y_m, limits=limits)

    def status(self) -> SystemStatus:
        """What runs, and how."""
        return self._connection.fetch(SystemStatus.of, "GET", "/v1/status")

    def missing_stage(self) -> str:
        """Why a search cannot start now, in a sentence; empty if it can."""
        try:
            self._connection.download("/readyz")
        except Unreachable:
            return "The gateway does not answer yet."
        except OneMapError as error:
            return error.detail
        return ""
