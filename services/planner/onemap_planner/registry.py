"""Registry of searches, shared by the control loop, the planning thread and the bus."""
# Talks: what that thread, the loop and the bus's threads share.

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace

from onemap_planner.policy.memory import NO_SYNONYMS, PlannerState, Synonyms
from onemap_planner.search.events import Cancelled, EventStamp, Interrupted
from onemap_planner.search.phases import Search
from onemap_planner.search.state_machine import transition
from onemap_shared.transport import RequestRejected

MAX_PAST_SEARCHES = 50  # older searches that are kept


class SearchRegistry:
    """Holds the planner state of the newest search and the older searches.

    The planning thread replaces the state only if it is still the one that its step began
    with: a search that is cancelled during a step stays cancelled. The time at which a search
    ends is recorded here, on ``clock_ns`` (nanoseconds since 1970). A command that cannot be
    carried out raises ``RequestRejected``.
    """

    def __init__(
        self, restored: Search | None = None, clock_ns: Callable[[], int] = time.time_ns
    ) -> None:
        self._clock_ns = clock_ns
        self._lock = threading.Lock()
        self._state = PlannerState(restored) if restored else None
        self._past: dict[str, Search] = {}

    @property
    def state(self) -> PlannerState | None:
        """State of the newest search; None if there was none."""
        return self._state

    def start(self, search: Search, synonyms: Synonyms = NO_SYNONYMS) -> Search:
        """Begin a new search; rejected while another is active. Found objects are kept."""
        with self._lock:
            self._reject_if_active()
            before = self._state
            self._state = PlannerState(search, synonyms=synonyms)
            if before is not None:
                self._state = replace(
                    self._state, found_objects=before.found_objects, known_m2=before.known_m2
                )
                self._past[before.search.search_id] = before.search
                while len(self._past) > MAX_PAST_SEARCHES:
                    del self._past[next(iter(self._past))]
            return search

    def reject_if_active(self) -> None:
        """Raise ``RequestRejected`` if a search is active."""
        with self._lock:
            self._reject_if_active()

    def clear_found_objects(self) -> None:
        """Remove the found objects, because the map is another one."""
        with self._lock:
            if self._state is not None and self._state.found_objects:
                self._state = replace(self._state, found_objects=())

    def _reject_if_active(self) -> None:
        if self._state is None or not self._state.search.active:
            return
        other = self._state.search
        raise RequestRejected(
            "conflict",
            f"search {other.search_id} for {other.subject} is still active: wait for it or cancel "
            "it",
        )

    def cancel(self, search_id: str, stamp: EventStamp) -> Search:
        """Cancel a search; one that is over stays as it ended."""
        with self._lock:
            search = self._find(search_id)
            if self._state is not None and search is self._state.search:
                search = self._stamped(transition(search, Cancelled(), stamp))
                self._state = replace(self._state, search=search)
            return search

    def interrupt(self, reason: str, stamp: EventStamp, ended_ns: int) -> None:
        """End the active search, if there is one, as interrupted at ``ended_ns``."""
        with self._lock:
            if self._state is not None and self._state.search.active:
                search = transition(self._state.search, Interrupted(reason), stamp)
                self._state = replace(self._state, search=replace(search, ended_ns=ended_ns))

    def find(self, search_id: str) -> Search:
        """The search of this id, the newest for an empty id."""
        with self._lock:
            return self._find(search_id)

    def all(self) -> list[Search]:
        """The remembered searches, newest first."""
        with self._lock:
            newest = [] if self._state is None else [self._state.search]
            return [*newest, *reversed(self._past.values())]

    def compare_and_swap(self, taken: PlannerState, next_state: PlannerState) -> bool:
        """Replace the state ``taken`` by the next one; False if it was changed meanwhile."""
        with self._lock:
            if self._state is not taken:
                return False
            self._state = replace(next_state, search=self._stamped(next_state.search))
            return True

    def _stamped(self, search: Search) -> Search:
        if search.active or search.ended_ns is not None:
            return search
        return replace(search, ended_ns=self._clock_ns())

    def _find(self, search_id: str) -> Search:
        if self._state is not None and search_id in ("", self._state.search.search_id):
            return self._state.search
        if search_id in self._past:
            return self._past[search_id]
        if not search_id:
            raise RequestRejected("unknown_search", "no search has been started yet")
        raise RequestRejected(
            "unknown_search",
            f"there is no search {search_id}; the last {MAX_PAST_SEARCHES} are remembered",
        )
