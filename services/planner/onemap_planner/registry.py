"""The desk where searches are ordered, called off and asked about; shared by all threads."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace

from onemap_planner.policy.competition import NO_SYNONYMS, Synonyms
from onemap_planner.policy.state import Mind
from onemap_planner.search.phases import Cancelled, Moment, Search
from onemap_planner.search.state_machine import begin, transition

KEPT = 50  # searches that can still be asked about


class DeskError(Exception):
    """A wish that cannot be granted: ``code`` for programs, the text for people."""

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code


class Desk:
    """Holds the mind of the newest search and what became of older ones.

    The planning thread takes a mind, thinks, and puts the next one back only if nobody
    changed it meanwhile: a search that is cancelled during a thought stays cancelled. Whoever
    ends a search, the desk notes when, on ``clock_ns`` (nanoseconds since 1970).
    """

    def __init__(
        self, restored: Search | None = None, clock_ns: Callable[[], int] = time.time_ns
    ) -> None:
        self._clock_ns = clock_ns
        self._lock = threading.Lock()
        self._mind = Mind(restored) if restored else None
        self._past: dict[str, Search] = {}

    @property
    def mind(self) -> Mind | None:
        """The newest search's mind; None if there never was a search."""
        return self._mind

    def start(
        self,
        search_id: str,
        objects: tuple[str, ...],
        moment: Moment,
        started_ns: int,
        synonyms: Synonyms = NO_SYNONYMS,
    ) -> Search:
        """Begin a search; refused while another is active. What was found before stays known."""
        with self._lock:
            self._refuse_second()
            before = self._mind
            search = begin(search_id, objects, moment, started_ns)
            self._mind = Mind(search, synonyms=synonyms)
            if before is not None:
                self._mind = replace(self._mind, claims=before.claims, known_m2=before.known_m2)
                self._past[before.search.search_id] = before.search
                while len(self._past) > KEPT:
                    del self._past[next(iter(self._past))]
            return search

    def refuse_second(self) -> None:
        """Raise DeskError if a search is active."""
        with self._lock:
            self._refuse_second()

    def forget_finds(self) -> None:
        """The map is another one: what was found on the old one claims no place on it."""
        with self._lock:
            if self._mind is not None and self._mind.claims:
                self._mind = replace(self._mind, claims=())

    def _refuse_second(self) -> None:
        if self._mind is None or not self._mind.search.active:
            return
        other = self._mind.search
        raise DeskError(
            "conflict",
            f"search {other.search_id} is still looking for {other.target!r}: wait for it or "
            "cancel it",
        )

    def cancel(self, search_id: str, moment: Moment) -> Search:
        """Call a search off; one that is over stays as it ended."""
        with self._lock:
            search = self._find(search_id)
            if self._mind is not None and search is self._mind.search:
                search = self._stamped(transition(search, Cancelled(), moment))
                self._mind = replace(self._mind, search=search)
            return search

    def find(self, search_id: str) -> Search:
        """The search of this id, the newest for an empty id."""
        with self._lock:
            return self._find(search_id)

    def put_back(self, taken: Mind, thought: Mind) -> bool:
        """Replace the mind that was taken by the next one; False if it was changed meanwhile."""
        with self._lock:
            if self._mind is not taken:
                return False
            self._mind = replace(thought, search=self._stamped(thought.search))
            return True

    def _stamped(self, search: Search) -> Search:
        if search.active or search.ended_ns is not None:
            return search
        return replace(search, ended_ns=self._clock_ns())

    def _find(self, search_id: str) -> Search:
        if self._mind is not None and search_id in ("", self._mind.search.search_id):
            return self._mind.search
        if search_id in self._past:
            return self._past[search_id]
        if not search_id:
            raise DeskError("unknown_search", "no search has been started yet")
        raise DeskError(
            "unknown_search", f"there is no search {search_id}; the last {KEPT} are remembered"
        )
