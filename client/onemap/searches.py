"""Searches of a robot: follow, wait for, cancel."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any
from urllib.parse import quote

from onemap.connection import Connection, InvalidSetting, OneMapError, StreamInterrupted
from onemap.search_replies import SearchListReply, SearchReplay, SearchSnapshot


@dataclass(frozen=True, slots=True)
class SearchLimits:
    """How far the robot may drive for a search and how long it may take; None: as far as it needs.

    At a limit the search ends as ``failed``, with ``distance_limit`` or ``time_limit``.
    """

    max_distance_m: float | None = None
    max_time_s: float | None = None

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if value is not None and not (isfinite(value) and value > 0):
                raise InvalidSetting(f"{name} is {value}: a limit must be positive and finite.")


NO_LIMITS = SearchLimits()


@dataclass(frozen=True, slots=True)
class SearchChanged:
    """The search is in another state, or has another result."""

    search: SearchSnapshot

    def __str__(self) -> str:
        """One line for people: object or place, state, reason."""
        return f"{self.search.subject}: {self.search.state}: {self.search.reason}"


SearchInterrupted = StreamInterrupted  # the search cannot be followed at the moment
SearchEvent = SearchChanged | SearchInterrupted


class RemoteSearch:
    """A search on the robot. ``latest`` is the newest snapshot that arrived here."""

    def __init__(self, connection: Connection, latest: SearchSnapshot) -> None:
        self._connection = connection
        self.latest = latest
        self._unanswered = False  # a request to go on may have begun a search unknown here

    def __repr__(self) -> str:
        """Id, subject and state: what a list of searches shows."""
        return f"RemoteSearch({self.id}, {self.latest.subject}, {self.latest.state})"

    @property
    def id(self) -> str:
        """The id by which ``client.searches.get`` finds the search again."""
        return self.latest.id

    def status(self) -> SearchSnapshot:
        """How is it going? Asks the robot."""
        path = f"/v1/searches/{self.id}"
        self.latest = self._connection.fetch(SearchSnapshot.of, "GET", path)
        return self.latest

    def replay(self) -> SearchReplay:
        """The recorded steps of the search with their reasons, and where the robot drove."""
        return self._connection.fetch(SearchReplay.of, "GET", f"/v1/searches/{self.id}/replay")

    def cancel(self, waiting: Callable[[str], None] = lambda _: None) -> SearchSnapshot:
        """Stop the robot and end the search; what was found so far stays in the results.

        Asks again for ten seconds if that is not confirmed, and tells ``waiting`` why; then raises
        OneMapError: the robot may still drive. After ``again`` without an answer it ends the
        newest search, whichever that is.
        """
        name = "current" if self._unanswered else self.id
        self.latest = self._connection.stop(SearchSnapshot.of, f"/v1/searches/{name}", waiting)
        return self.latest

    def again(self) -> RemoteSearch:
        """Go on with what it has not found, as it was asked for, or drive to its place again.

        A search whose planner or driver has ended is ``interrupted``; no robot goes on by itself.
        May be repeated, as after an answer that was lost: what it began is returned, though that
        was cancelled meanwhile; going on with that needs its own ``again``.
        """
        path = f"/v1/searches/{self.id}/again"
        try:
            begun = self._connection.fetch(SearchSnapshot.of, "POST", path)
        except OneMapError as error:
            self._unanswered = self._unanswered or error.temporary
            raise
        self._unanswered = False
        return RemoteSearch(self._connection, begun)

    def wait(self, *, again: bool = False) -> SearchSnapshot:
        """The final state, when it is reached; raises OneMapError as ``events`` does."""
        for _ in self.events(again=again):
            pass
        return self.latest

    def events(self, *, again: bool = False) -> Iterator[SearchEvent]:
        """Every change of the search from now on; ends with the final state.

        The first event is the present state. An interrupted stream is opened again while the
        search runs, and the interruption is an event. again: a search that is interrupted by the
        end of its planner or driver is asked for again at once, and this object becomes the new
        one. Raises OneMapError if the gateway stays away (see ``Retry``), or does not have the
        search any more.
        """
        yield from self._changes()
        while again and self.latest.state == "interrupted":
            self.latest = self._connection.repeated(self.again).latest
            yield from self._changes()

    def _changes(self) -> Iterator[SearchEvent]:
        last: SearchSnapshot | None = None
        path = f"/v1/searches/{self.id}/events"
        for event in self._connection.follow(path, "status", SearchSnapshot.of):
            if isinstance(event, StreamInterrupted):
                yield event
            elif last is None or _differ(last, event):
                self.latest = last = event
                yield SearchChanged(event)
                if not last.active:
                    return


class RemoteSearches:
    """The robot's searches: ``client.searches``."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def get(self, search_id: str = "current") -> RemoteSearch:
        """A search by its id; ``current`` is the newest."""
        return self._search("GET", f"/v1/searches/{quote(search_id, safe='')}")

    def list(self) -> tuple[RemoteSearch, ...]:
        """The newest 50 searches and the present one, newest first."""
        listed = self._connection.fetch(SearchListReply.of, "GET", "/v1/searches")
        return tuple(RemoteSearch(self._connection, each) for each in listed.searches)

    def start(self, asked: Mapping[str, Any], limits: SearchLimits) -> RemoteSearch:
        """Start what the body of a request describes, see `Client.search` and `Client.go_to`."""
        given = {name: value for name, value in asdict(limits).items() if value is not None}
        return self._search("POST", "/v1/searches", {**asked, **given})

    def _search(
        self, method: str, path: str, body: Mapping[str, Any] | None = None
    ) -> RemoteSearch:
        snapshot = self._connection.fetch(SearchSnapshot.of, method, path, body)
        return RemoteSearch(self._connection, snapshot)


def _differ(a: SearchSnapshot, b: SearchSnapshot) -> bool:
    """Whether more than the time has changed."""
    return a != b.model_copy(update={"elapsed_s": a.elapsed_s})
