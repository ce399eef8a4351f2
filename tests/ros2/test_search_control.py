"""Searches that ROS 2 starts, follows and cancels."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

from onemap_ros2.cdr import STRING, TRIGGER, decode, encode, new
from onemap_ros2.config import Ros2Config
from onemap_ros2.search_control import SearchControl
from onemap_shared import messages as m
from onemap_shared.keys import MAP_PLACES, SEARCH_CANCEL, SEARCH_START
from onemap_shared.transport import RequestRejected
from tests.gateway.fakes import map_places
from tests.memory_bus import MemoryRouter
from tests.ros2.fake_network import FakeNetwork, FakeRequest
from tests.ros2.planner_messages import status
from tests.shared.test_bus import eventually

FOUND = m.ObjectResult(
    "sofa",
    m.SearchState.FOUND,
    "there",
    (1.0, 2.0, 0.4000001),
    0.75,
    9.0,
    3.0,
    (0.0, 0.0),
    (1.0, 1.0),
)


class Planner:
    """A planner in memory behind the adapter's half for searches; ``rejects``: why it refuses."""

    def __init__(self) -> None:
        router = MemoryRouter()
        self.bus = router.bus("planner")
        self.started: list[tuple[str, ...]] = []
        self.details: list[tuple[str, ...]] = []
        self.stay_out: tuple[str, ...] = ()
        self.rejects, self.stands = "", True
        self.network = FakeNetwork()
        config = Ros2Config.model_validate({"namespace": "/r1", "map_frame": "odom"})
        self.control = SearchControl(router.bus("ros2"), self.network, config)

    def serve(self) -> None:
        self.bus.serve(SEARCH_START, self._start)
        self.bus.serve(SEARCH_CANCEL, self._cancel)

    def _start(self, request: m.SearchRequest) -> m.SearchStatus:
        if self.rejects:
            raise RequestRejected("conflict", self.rejects)
        self.started.append(request.objects)
        self.details.append(tuple(each.colour for each in request.details))
        self.stay_out = request.stay_out
        return status("s1")

    def _cancel(self, request: m.SearchId) -> m.SearchStatus:
        assert request.search_id == ""
        return status("s1", m.SearchState.CANCELLED)

    def say(self, word: str) -> None:
        self.network.say("/r1/onemap/search", encode(new(STRING, word), STRING))
        self.control.step(None, stands=self.stands)

    def state(self, newest: m.SearchStatus | None = None) -> dict[str, Any]:
        """What ``/onemap/state`` shows."""
        self.control.step(newest, stands=self.stands)
        sent = self.network.writers["/r1/onemap/state", STRING].sent
        document: dict[str, Any] = json.loads(decode(sent[-1], STRING).data)
        return document

    def cancel(self) -> tuple[bool, str]:
        request = FakeRequest(b"")
        self.network.services["/r1/onemap/cancel"].waiting.append(request)
        self.control.step(None, stands=self.stands)
        answer = decode(request.answers.get(timeout=30), f"{TRIGGER}_Response")
        return answer.success, answer.message


@pytest.fixture
def planner() -> Iterator[Planner]:
    made = Planner()
    yield made
    made.control.close()


def test_words_start_a_search_and_a_service_cancels_it(planner: Planner) -> None:
    planner.serve()
    assert planner.state() == {"state": "none", "refused": ""}
    assert planner.network.latched == {"/r1/onemap/state"}  # not the word: it would start again
    planner.say("sofa, red lamp")
    eventually(lambda: planner.started or None)
    assert planner.started == [("sofa", "lamp")]
    assert planner.details == [("", "red")]
    assert planner.cancel() == (True, "it looks")


def test_a_cancellation_waits_for_no_word_and_holds_for_those_before_it(
    planner: Planner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_ros2.search_control.ANSWER_S", 60.0)
    released, asked = threading.Event(), list[m.SearchRequest]()

    def checked(request: m.SearchRequest) -> m.SearchStatus:
        asked.append(request)
        released.wait(60.0)
        return status("s1")

    planner.serve()
    planner.bus.serve(SEARCH_START, checked)
    for word in ("sofa", "bed", "chair"):
        planner.say(word)
    said_s = time.monotonic()
    eventually(lambda: asked or None)
    assert planner.cancel() == (True, "it looks")
    held_s = time.monotonic() - said_s
    assert len(asked) == 1
    released.set()
    eventually(lambda: len(asked) == 3 or None)
    assert asked[-1].age_s >= held_s


def test_a_cancellation_succeeds_only_if_the_robot_stands(
    planner: Planner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_ros2.search_control.STAND_S", 0.0)
    planner.serve()
    planner.stands = False
    succeeded, message = planner.cancel()
    assert not succeeded
    assert "the robot does not stand after 0 s: stop it by other means" in message
    planner.stands = True
    assert planner.cancel() == (True, "it looks")


def test_a_sentence_is_understood_with_the_places_of_the_map(planner: Planner) -> None:
    planner.serve()
    planner.bus.serve(MAP_PLACES, lambda _: map_places(m.Place("Hall", inside_m=(0.0, 0.0))))
    planner.say("lamp over the bed")
    refused = eventually(lambda: planner.state()["refused"] or None)
    assert "'over the bed' is not understood" in refused
    planner.say("red lamp, next to the bed in the bathroom, sofa, stay out of the hall")
    eventually(lambda: planner.started or None)
    assert planner.started == [("lamp", "sofa")]
    assert (planner.details, planner.stay_out) == ([("red", "")], ("Hall",))


@pytest.mark.parametrize(
    ("word", "why"), [("", "is empty"), ("7", "no readable word"), ("sofa", "the robot is busy")]
)
def test_a_refused_word_is_told_until_the_next_search(
    planner: Planner, word: str, why: str
) -> None:
    planner.serve()
    planner.rejects = "the robot is busy"
    planner.say(word)
    assert why in eventually(lambda: planner.state()["refused"] or None)
    planner.rejects = ""
    planner.say("chair")
    eventually(lambda: planner.state()["refused"] == "" or None)
    assert planner.started == [("chair",)]


def test_without_a_planner_both_are_refused(planner: Planner) -> None:
    planner.say("sofa")
    assert "'sofa'" in eventually(lambda: planner.state()["refused"] or None)
    success, why = planner.cancel()
    assert not success
    assert why


def test_the_state_has_the_finds_and_is_sent_when_it_changes(planner: Planner) -> None:
    planner.state()
    found = replace(status("s1", m.SearchState.FOUND), results=(FOUND,), path_length_m=3.0)
    first = planner.state(found)
    assert (first["state"], first["id"], first["objects"]) == ("found", "s1", ["sofa"])
    assert (first["object"], first["frame"], first["path_length_m"]) == ("", "odom", 3.0)
    (result,) = first["results"]
    assert (result["object"], result["outcome"]) == ("sofa", "found")
    assert (result["position_m"], result["score"]) == ([1.0, 2.0, 0.4], 0.75)
    planner.state(found)
    assert len(planner.network.writers["/r1/onemap/state", STRING].sent) == 2
