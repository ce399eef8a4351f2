"""Starts, follows and cancels searches from ROS 2, with ROS 2's own message types.

``/onemap/search`` takes the word, ``/onemap/cancel`` ends the search, ``/onemap/state`` says how it
stands: no standard service carries a word, and an interface of our own would have to be built
wherever it is called.
"""
# Talks: asks the planner in threads, because the loop that stops the robot must not wait.

from __future__ import annotations

import json
import logging
from dataclasses import replace

from onemap_ros2.cdr import STRING, TRIGGER, decode, encode, new
from onemap_ros2.config import Ros2Config
from onemap_ros2.network.interface import RosNetwork, ServiceRequest
from onemap_shared.clock import Future
from onemap_shared.keys import MAP_PLACES, SEARCH_CANCEL, SEARCH_START
from onemap_shared.messages import PlacesRequest, SearchId, SearchRequest, SearchStatus
from onemap_shared.sentence import listed_sentences, parse, search_for
from onemap_shared.transport import Bus, CallError

LOG = logging.getLogger("onemap.ros2")
SEARCH, CANCEL, STATE = "search", "cancel", "state"  # below /onemap
ANSWER_S = 3.0  # for the planner to answer, as the gateway gives it
STAND_S = 3.0  # for the robot to stand after the search was cancelled: nav2 brakes within one
KEPT = 5  # words between two steps
CANCELS = 8  # at once: each waits for the robot to stand, and none for another


class SearchControl:
    """One search at a time; ``status``: of the newest one, None before the first."""

    def __init__(self, bus: Bus, network: RosNetwork, config: Ros2Config) -> None:
        self._bus, self._frame = bus, config.map_frame
        prefix = config.in_namespace("/onemap")
        # Never latched: the word of yesterday must not move a robot that starts today.
        self._words = network.read(f"{prefix}/{SEARCH}", STRING, KEPT, reliable=True)
        self._cancels = network.serve(f"{prefix}/{CANCEL}", TRIGGER)
        self._writer = network.write(f"{prefix}/{STATE}", STRING, latched=True)
        self._starts = bus.clock.pool(1, "search-start")
        self._stops = bus.clock.pool(CANCELS, "search-cancel")
        self._stands = bus.clock.event()  # the robot does, and nothing of ours may move it
        self._refused = self._said = ""
        self.status: SearchStatus | None = None

    def step(self, status: SearchStatus | None, *, stands: bool) -> None:
        """Take commands and publish what is new; ``status``: that the planner sent just now.

        stands: whether the robot does, and nothing of ours may move it.
        """
        self.status = status or self.status
        (self._stands.set if stands else self._stands.clear)()
        for data in self._words.take():
            said_s = self._bus.clock.monotonic_s()
            self._starts.submit(self._start, data, said_s).add_done_callback(_report)
        for request in self._cancels.take():
            self._stops.submit(self._cancel, request).add_done_callback(_report)
        text = state_text(self.status, self._refused, self._frame)
        if text != self._said:
            self._said = text
            self._writer.put(encode(new(STRING, text), STRING))

    def close(self) -> None:
        """Take no more commands."""
        self._starts.shutdown(wait=False, cancel_futures=True)
        self._stops.shutdown(wait=False, cancel_futures=True)

    def _start(self, data: bytes, said_s: float) -> None:
        word = ""
        try:
            word = str(decode(data, STRING).data)
            request = self._request(word)
            age_s = self._bus.clock.monotonic_s() - said_s
            self._bus.call(SEARCH_START, replace(request, age_s=age_s), ANSWER_S)
            self._refused = ""
        except (ValueError, CallError) as problem:
            self._refused = f"no search for {word[:50]!r}: {problem}"
            LOG.warning("%s", self._refused)

    def _request(self, word: str) -> SearchRequest:
        """The search for what a text lists; ValueError if it is not understood.

        The planner refuses places that the map does not know.
        """
        texts = listed_sentences(word)
        sentences = [parse(text) for text in texts]
        if any(each.asks_for_places for each in sentences):
            known = self._bus.call(MAP_PLACES, PlacesRequest(), ANSWER_S).places
            sentences = [parse(text, [place.name for place in known]) for text in texts]
        return search_for(sentences, ANSWER_S)

    def _cancel(self, request: ServiceRequest) -> None:
        try:
            status = self._bus.call(SEARCH_CANCEL, SearchId(), ANSWER_S)
            answer = True, status.reason
            if not self._stands.wait(STAND_S):
                how = f"but the robot does not stand after {STAND_S:g} s: stop it by other means"
                answer = False, f"{status.reason}, {how}"
        except CallError as problem:
            answer = False, str(problem)
        request.reply(encode(new(f"{TRIGGER}_Response", *answer), f"{TRIGGER}_Response"))


def _report(done: Future[None]) -> None:
    if not done.cancelled() and (problem := done.exception()) is not None:
        LOG.error("a command from ROS 2 failed: %r", problem)


def state_text(status: SearchStatus | None, refused: str, frame: str) -> str:
    """The search as JSON; state ``none`` before the first one.

    refused: why the newest word began no search; empty if it did. results: of the objects that are
    done, with x, y, z in metres of ``frame``, empty for one that was not found.
    """
    document: dict[str, object] = {"state": "none", "refused": refused}
    if status is not None:
        results = [
            {
                "object": result.name,
                "outcome": str(result.outcome),
                "reason": result.reason,
                "position_m": [round(value, 3) for value in result.position_m],
                "score": round(result.score, 3),
            }
            for result in status.results
        ]
        document |= {
            "state": str(status.state),
            "id": status.search_id,
            "objects": status.objects,
            "object": status.target,
            "reason": status.reason,
            "path_length_m": round(status.path_length_m, 2),
            "frame": frame,
            "results": results,
        }
    return json.dumps(document, ensure_ascii=False)
