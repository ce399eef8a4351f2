"""The searches of a planner, and the calls about them: start, cancel, get, list, record."""
# Talks: shared by the loop, the planning thread and the bus's threads, which it answers.

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import accumulate
from pathlib import Path

from onemap_planner.inputs import LatestInputs
from onemap_planner.named_places import goal_m
from onemap_planner.policy.names import synonyms_of
from onemap_planner.policy.state import NO_SYNONYMS, PlannerState, Synonyms
from onemap_planner.search import decision_log
from onemap_planner.search import state_machine as sm
from onemap_planner.sentences import MAP_REPLACED, NO_WAY_BACK, no_place
from onemap_shared import keys
from onemap_shared.clock import Clock
from onemap_shared.messages import (
    BACK,
    PlacesRequest,
    SearchId,
    SearchKind,
    SearchList,
    SearchListRequest,
    SearchRecord,
    SearchRequest,
    SearchState,
    SearchStatus,
    subject_of,
)
from onemap_shared.names import normalised, same_name
from onemap_shared.places import Zones
from onemap_shared.sentence import ROOM_WORDS
from onemap_shared.text_embedding import embed_texts
from onemap_shared.transport import Bus, CallError, NoReply, RemoteError, RequestRejected
from onemap_shared.wire import MAX_HEADER_BYTES, encode

MAX_PAST_SEARCHES = 50  # older searches that are kept
STOPPED = (
    "nothing was started: after this was asked for, the robot was told to stop, or its planner was "
    "restarted; ask again if it is to set out"
)


class SearchRegistry:
    """Holds the planner state of the newest search and the older searches.

    The planning thread replaces the state only if it is still the one that its step began
    with: a search that is cancelled during a step stays cancelled. The time at which a search
    ends is recorded here, by the wall clock. A command that cannot be
    carried out raises ``RequestRejected``.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock, self._lock = clock, clock.rlock()
        self._state: PlannerState | None = None
        self._past: dict[str, sm.Search] = {}
        # When somebody last asked for a stop, whatever ran; maybe a planner that has ended since.
        self._stopped_s = clock.monotonic_s()

    @property
    def state(self) -> PlannerState | None:
        """State of the newest search; None if there was none."""
        return self._state

    def start(
        self,
        search: sm.Search,
        synonyms: Synonyms = NO_SYNONYMS,
        asked_s: float = math.inf,
        check: Callable[[], None] = lambda: None,
    ) -> sm.Search:
        """Begin a new search, for which somebody asked at ``asked_s``; rejected if a stop came
        since then, while another search is active, and if the search that it continues was
        continued before. Found objects are kept. check: rejects it by what may change until now."""
        with self._lock:
            check()
            if self._stopped_s > asked_s:
                raise RequestRejected("stopped", STOPPED)
            self.reject_if_active()
            self._reject_if_continued(search.continues)
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
            if self._state is None or not self._state.search.active:
                return
            other = self._state.search
        raise RequestRejected(
            "conflict",
            f"search {other.search_id} for {other.subject} is still active: wait for it or cancel "
            "it",
        )

    def _reject_if_continued(self, search_id: str) -> None:
        """A request that is repeated after a lost answer must not start a robot that was stopped
        meanwhile."""
        known = [*self._past.values(), *([self._state.search] if self._state else [])]
        for other in known:
            if search_id and other.continues == search_id:
                raise RequestRejected(
                    "conflict",
                    f"search {search_id} was continued as {other.search_id}: continue that one",
                )

    def clear_found_objects(self) -> None:
        """Remove the found objects, because the map is another one."""
        with self._lock:
            if self._state is not None and self._state.found_objects:
                self._state = replace(self._state, found_objects=())

    def replace_map(self, stamp: sm.EventStamp) -> None:
        """End a drive to coordinates of the map before, also back; a search has no way back."""
        with self._lock:
            if self._state is None or not self._state.search.active:
                return
            search = replace(self._state.search, start_lost=True)
            if search.destination is not None or search.way_back is not None:
                search = sm.transition(search, sm.Ending(SearchState.FAILED, MAP_REPLACED), stamp)
            self._state = replace(self._state, search=self._stamped(search))

    def cancel(self, search_id: str, stamp: sm.EventStamp) -> sm.Search:
        """Cancel a search; one that is over stays as it ended. A start that is still checked is
        rejected, also where no search has this id: who stops may know nothing of it."""
        with self._lock:
            self._stopped_s = self._clock.monotonic_s()
            search = self.find(search_id)
            if self._state is not None and search is self._state.search:
                search = self._stamped(sm.transition(search, sm.CANCELLED, stamp))
                self._state = replace(self._state, search=search)
            return search

    def interrupt(self, reason: str, stamp: sm.EventStamp, ended_ns: int) -> None:
        """End the active search, if there is one, as interrupted at ``ended_ns``."""
        with self._lock:
            if self._state is not None and self._state.search.active:
                ending = sm.Ending(SearchState.INTERRUPTED, reason, whole=True)
                search = sm.transition(self._state.search, ending, stamp)
                self._state = replace(self._state, search=replace(search, ended_ns=ended_ns))

    def find(self, search_id: str) -> sm.Search:
        """The search of this id, the newest for an empty id."""
        with self._lock:
            if self._state is not None and search_id in ("", self._state.search.search_id):
                return self._state.search
            if search_id in self._past:
                return self._past[search_id]
        why = "no search has been started yet"
        if search_id:
            why = f"there is no search {search_id}; the last {MAX_PAST_SEARCHES} are remembered"
        raise RequestRejected("unknown_search", why)

    def all(self) -> list[sm.Search]:
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

    def _stamped(self, search: sm.Search) -> sm.Search:
        if search.active or search.ended_ns is not None:
            return search
        return replace(search, ended_ns=self._clock.wall_ns())


EMBED_TIMEOUT_S = 1.5  # for all names of a search; the gateway gives the whole call 3 s
PLACES_TIMEOUT_S = 0.8  # rooms are cut anew where the map changed
SYNONYMS_TIMEOUT_S = 0.5  # the same once more with the names found before
LIST_BYTES = MAX_HEADER_BYTES - 1024  # of all searches in a list; the rest is the list itself


class SearchCommands:
    """Serves the calls on the bus.

    inputs: returns the latest inputs; status_of: the message about a search; folder: where
    searches are recorded, also those of before a restart.
    """

    def __init__(
        self,
        bus: Bus,
        registry: SearchRegistry,
        *,
        inputs: Callable[[], LatestInputs],
        status_of: Callable[[sm.Search], SearchStatus],
        folder: Path | None = None,
    ) -> None:
        self._bus, self._registry, self._folder = bus, registry, folder
        self._inputs, self._status_of, self._clock = inputs, status_of, bus.clock
        bus.serve(keys.SEARCH_START, self._start)
        bus.serve(keys.SEARCH_CANCEL, self._cancel)
        bus.serve(keys.SEARCH_GET, self._get)
        bus.serve(keys.SEARCH_LIST, self._list)
        bus.serve(keys.SEARCH_RECORD, self._record)

    def _start(self, request: SearchRequest) -> SearchStatus:
        began_s, frame = self._clock.monotonic_s(), self._frame()
        self._registry.reject_if_active()
        others = [n for each in request.details for n in (*each.anchors, *each.negatives)]
        names = tuple(dict.fromkeys((*request.objects, *others)))
        synonyms = self._check_names(names) if names else NO_SYNONYMS
        request = self._placed(request)
        driver, map_count, jump_count = frame
        _reject_if_late(request, self._clock.monotonic_s() - began_s)
        search = sm.new_search(
            self._clock.random.randbytes(6).hex(),
            request.objects,
            self._stamp(),
            self._clock.wall_ns(),
            sm.Destination.of(request),
        )
        search = replace(
            search,
            budget=sm.Budget.of(request),
            details=request.details,
            stay_out=request.stay_out,
            continues=request.continues,
            after=request.after,
            driver=driver,
            map_count=map_count,
            jump_count=jump_count,
        )
        # With the lock that the end of a map or a driver takes: one that comes later ends it.
        check = partial(self._reject_if_another, frame, request)
        asked_s = began_s - request.age_s
        return self._status_of(self._registry.start(search, synonyms, asked_s, check))

    def _cancel(self, request: SearchId) -> SearchStatus:
        """Cancel this search; beside another planner, whichever is active here.

        Who cancels wants the robot to stop, and may name a search of the other planner.
        """
        if self._other_planners() and self._registry.state is not None:
            self._registry.cancel("", self._stamp())
        return self._status_of(self._registry.cancel(request.search_id, self._stamp()))

    def _other_planners(self) -> bool:
        own = ("planner", self._bus.instance)
        return any(each[0] == "planner" and each != own for each in self._bus.members())

    def _get(self, request: SearchId) -> SearchStatus:
        try:
            search = self._registry.find(request.search_id)
            status = self._status_of(search)
            return status if self._has_frame_of_now(search) else replace(status, start_m=())
        except RequestRejected:
            for status in self._earlier():
                if request.search_id in ("", status.search_id):
                    return status
            raise

    def _list(self, _request: SearchListRequest) -> SearchList:
        known = [self._status_of(search) for search in self._registry.all()]
        return list_of([*known, *self._earlier()])

    def _earlier(self) -> list[SearchStatus]:
        """The recorded searches that are not in the registry: of before a restart."""
        known = {search.search_id for search in self._registry.all()}
        recorded = decision_log.past(self._folder) if self._folder else []
        return [each for each in recorded if each.search_id not in known]

    def _record(self, request: SearchId) -> SearchRecord:
        status = self._get(request)
        known = decision_log.read(self._folder, status.search_id) if self._folder else None
        if known is None:
            why = "its file is gone or damaged" if self._folder else "planner.state_dir is not set"
            raise RequestRejected(
                "unknown_search", f"nothing is recorded of search {status.search_id}: {why}"
            )
        return replace(known, status=status)

    def _frame(self) -> tuple[int, int, int]:
        """Counts of the driver and the map whose coordinates are used now, the first if none was
        heard yet, and of the jumps of the robot's pose so far."""
        inputs = self._inputs()
        return max(inputs.driver.count, 1), max(inputs.map_count, 1), inputs.jump_count

    def _has_frame_of_now(self, search: sm.Search) -> bool:
        return (search.driver, search.map_count, search.jump_count) == self._frame()

    def _reject_if_another(self, asked: tuple[int, int, int], request: SearchRequest) -> None:
        """Reject a request that was made to another driver, and a drive to coordinates whose
        frame began anew, since ``asked``, or since the search that it continues."""
        now, to_coordinates = self._frame(), request.kind is not SearchKind.FIND
        if now[0] != asked[0] or (to_coordinates and now != asked):
            raise RequestRejected(
                "stopped",
                "nothing was started: while the request was checked, the robot's driver or the map "
                "was replaced, or the robot's position jumped; ask again",
            )
        if to_coordinates and request.continues:
            self._reject_coordinates_of_before(request.continues)

    def _reject_coordinates_of_before(self, search_id: str) -> None:
        """Reject a drive to the place of a search whose coordinates may be another place now."""
        with suppress(RequestRejected):
            if self._has_frame_of_now(self._registry.find(search_id)):
                return
        raise RequestRejected(
            "conflict",
            "since that search began, the planner, the robot's driver or the map was replaced, or "
            "the robot's position jumped: its coordinates may be another place now, so say again "
            "where to drive",
        )

    def _check_names(self, objects: tuple[str, ...]) -> Synonyms:
        """Reject names that perception cannot embed or that resemble nothing it was trained on.

        Returns which of these objects and of the objects found before mean the same.
        """
        embeddings = embed_texts(self._bus, objects, EMBED_TIMEOUT_S)
        state = self._registry.state
        found = [found_object.name for found_object in state.found_objects] if state else []
        if found:
            names = tuple(dict.fromkeys((*objects, *found)))
            with suppress(RequestRejected):  # another encoder, perhaps: then names must be equal
                embeddings = embed_texts(self._bus, names, SYNONYMS_TIMEOUT_S)
        return synonyms_of(embeddings)

    def _placed(self, request: SearchRequest) -> SearchRequest:
        """The request with the coordinates of the place that it names; rejected if it names one
        that the map has not, or is a drive to where no robot may be.

        A room's word may name a place as soon as there is one. Nothing begins while the mapper
        cannot read its places; one that is silent is waited for.
        """
        if same_name(request.place, BACK):
            request = replace(request, place="", place_m=self._back_m())
        told = (name for each in request.details for name in (*each.inside, *each.outside))
        places_of_objects = (name for name in told if normalised(name) not in ROOM_WORDS)
        goal = (request.place,) if request.place else ()
        names = dict.fromkeys((*goal, *request.stay_out, *places_of_objects))
        needed = bool(names) or request.kind is SearchKind.GO_TO
        try:
            places = self._bus.call(keys.MAP_PLACES, PlacesRequest(), PLACES_TIMEOUT_S)
        except NoReply as problem:  # of an earlier release, perhaps: it has none
            if not names:
                return request
            why = "no mapper answers for the places of the map"
            raise RequestRejected("unavailable", why) from problem
        except CallError as problem:
            if not (needed or isinstance(problem, RemoteError)):
                return request
            why = f"the places of the map are not known: {problem}"
            raise RequestRejected("unavailable", why) from problem
        for name in names:
            if (found := places.get(name)) is None:
                known = tuple(place.name for place in places.places)
                raise RequestRejected("unknown_place", no_place(name, known))
            if name == request.place:
                request = replace(request, place="", place_m=goal_m(found[0]))
        if request.kind is SearchKind.GO_TO:
            x_m, y_m = request.place_m
            zones = Zones(places, request.stay_out)
            if zone := zones.at((x_m, y_m), 0.0, places.grid.cell_size_m):
                where = subject_of("", request.place_m)
                raise RequestRejected("keep_out", f"{where} lies in the keep-out zone {zone!r}")
        return request

    def _back_m(self) -> tuple[float, ...]:
        """x, y of where the robot stood when the last search was accepted, in the frame of now."""
        with suppress(RequestRejected):
            search = self._registry.find("")
            start_m = self._status_of(search).start_m
            if start_m and self._has_frame_of_now(search):
                return start_m
        raise RequestRejected("unknown_place", NO_WAY_BACK)

    def _stamp(self) -> sm.EventStamp:
        inputs = self._inputs()
        xy = inputs.pose.xy if inputs.pose else None
        return sm.EventStamp(self._clock.monotonic_s(), 0.0, xy, inputs.odometer_m)


def list_of(statuses: Sequence[SearchStatus]) -> SearchList:
    """The searches in this order, as many as one message holds."""
    sizes = accumulate(len(encode(status).header) for status in statuses)
    count = sum(size <= LIST_BYTES for size in sizes)
    return SearchList(tuple(statuses[:count]), len(statuses) - count)


def _reject_if_late(request: SearchRequest, took_s: float) -> None:
    """Reject a request whose caller has stopped waiting meanwhile: no robot may start for it."""
    waited_s = took_s + (keys.SEARCH_START.stale_after_s or 0.0)
    if waited_s > request.patience_s:
        raise RequestRejected(
            "busy",
            f"checking the words took {took_s:.1f} s of the {request.patience_s:g} s that the "
            "caller waits: nothing was started; try again",
        )
