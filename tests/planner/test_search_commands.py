"""Searches start, are cancelled and found by calls; names are checked before the robot moves."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any

import pytest

from onemap_planner.search.state_machine import Search
from onemap_shared import keys
from onemap_shared.geometry import pose_2d
from onemap_shared.messages import (
    Detail,
    Place,
    Relation,
    RelationKind,
    SearchId,
    SearchList,
    SearchListRequest,
    SearchRequest,
    TextEmbeddings,
    TextRequest,
)
from onemap_shared.transport import RemoteError
from tests.planner.drawn_maps import places_of
from tests.planner.simulated_services import ROOM, SimulatedServices, embeddings, moves


def test_names_are_checked_before_the_robot_moves(services: SimulatedServices) -> None:
    with pytest.raises(RemoteError, match=r"'flurb' .did you mean 'curb'") as caught:
        services.start("sofa", "flurb")
    assert caught.value.code == "unknown_word"
    assert caught.value.details == {"words": [{"word": "flurb", "did_you_mean": ["curb"]}]}
    for _ in range(5):
        services.frame()
    assert services.sent_commands() == []
    assert services.states.take(0.0) is None
    with pytest.raises(RemoteError, match="no search has been started"):
        services.get()


def test_a_description_is_checked_and_told(services: SimulatedServices) -> None:
    nursery = Place("nursery", corners_m=((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
    services.serve_places(places_of(ROOM.grid, nursery))
    beside = Detail(relations=(Relation(RelationKind.NEXT_TO, ("flurb",)),))
    request = SearchRequest(("sofa",), details=(beside,), stay_out=("nursery",))
    with pytest.raises(RemoteError, match="'flurb'"):
        services.caller.call(keys.SEARCH_START, request)
    request = replace(request, details=(replace(beside, colour="red", relations=()),))
    services.caller.call(keys.SEARCH_START, request)
    status = services.get()
    assert (status.details, status.stay_out) == (request.details, ("nursery",))


def test_without_perception_no_search_starts(services: SimulatedServices) -> None:
    services.perception.close()
    with pytest.raises(RemoteError, match="words cannot be looked up") as caught:
        services.start("sofa")
    assert caught.value.code == "perception_missing"
    services.frame()
    assert services.states.take(0.0) is None


def test_a_perception_that_hangs_is_named(
    services: SimulatedServices, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_planner.searches.EMBED_TIMEOUT_S", 0.01)
    released = threading.Event()

    def hang(request: TextRequest) -> TextEmbeddings:
        released.wait(60.0)
        return embeddings(request)

    services.perception.serve(keys.EMBED_TEXT, hang)
    with pytest.raises(RemoteError, match="in time") as caught:
        services.start("sofa")
    released.set()
    assert caught.value.code == "perception_silent"


def test_no_search_starts_for_a_caller_that_gave_up(services: SimulatedServices) -> None:
    """The words were checked, but too late."""
    patience_s = 0.5 * (keys.SEARCH_START.stale_after_s or 0.0)
    with pytest.raises(RemoteError, match="nothing was started") as caught:
        services.caller.call(keys.SEARCH_START, SearchRequest(("sofa",), patience_s))
    assert caught.value.code == "busy"
    with pytest.raises(RemoteError, match="no search has been started"):
        services.get()


@pytest.mark.parametrize("another", ["driver", "map", "planner", "jump", "beside"])
def test_nobody_is_sent_to_coordinates_of_before(services: SimulatedServices, another: str) -> None:
    """Neither back to where the robot stood, nor once more to the place of a drive."""
    for _ in range(3):
        services.frame()
    services.go_to(3.0, 2.0)
    services.caller.call(keys.SEARCH_CANCEL, SearchId())
    assert services.get().start_m == (2.0, 2.0)
    services.caller.call(keys.SEARCH_START, services.get().again(2.0))
    services.caller.call(keys.SEARCH_CANCEL, SearchId())
    if another == "driver":
        services.restart_driver(named=True, joined=False)
    elif another == "map":
        services.count = 0
    elif another == "jump":
        services.pose = pose_2d(2.0, 4.0, 0.0)  # no slow machine drives so far in a frame
    elif another == "beside":
        services.offset_m = 0.4
    else:
        services.planner.close()
        services.planner_bus.close()
        services.start_planner()
    services.frame()
    assert services.get().start_m == ()
    with pytest.raises(RemoteError, match="say again where to drive"):
        services.caller.call(keys.SEARCH_START, services.get().again(2.0))
    services.go_to(3.0, 2.0)


@contextmanager
def checked(services: SimulatedServices, request: SearchRequest) -> Iterator[Future[object]]:
    """While the planner checks the words of a request; afterwards its answer."""
    asked, released = threading.Event(), threading.Event()

    def slow(texts: TextRequest) -> TextEmbeddings:
        asked.set()
        released.wait(60.0)
        return embeddings(texts)

    services.perception.serve(keys.EMBED_TEXT, slow)
    with ThreadPoolExecutor(1) as caller:
        started: Future[object] = caller.submit(services.caller.call, keys.SEARCH_START, request)
        assert asked.wait(60.0)
        yield started
        released.set()


@pytest.mark.parametrize("earlier", [True, False])
def test_a_stop_ends_a_start_that_is_still_checked(
    services: SimulatedServices, monkeypatch: pytest.MonkeyPatch, earlier: bool
) -> None:
    monkeypatch.setattr("onemap_planner.searches.EMBED_TIMEOUT_S", 60.0)
    if earlier:
        services.start("bed")
        services.caller.call(keys.SEARCH_CANCEL, SearchId())
        services.sent_commands()
    request = SearchRequest(("sofa",), patience_s=60.0)
    with checked(services, request) as started, suppress(RemoteError):
        services.caller.call(keys.SEARCH_CANCEL, SearchId())
    with pytest.raises(
        RemoteError, match="after this was asked for, the robot was told to stop"
    ) as caught:
        started.result()
    assert caught.value.code == "stopped"
    for _ in range(5):
        services.frame()
    assert not any(map(moves, services.sent_commands()))


@pytest.mark.parametrize("again", [True, False], ids=["planner begins", "stop"])
def test_a_stop_ends_what_was_asked_of_the_gateway_before_it(
    services: SimulatedServices, again: bool
) -> None:
    """A planner that begins does not know whether the one before was told to stop."""
    with suppress(RemoteError):
        services.caller.call(keys.SEARCH_CANCEL, SearchId())
    if again:
        services.planner.close()
        services.planner_bus.close()
        services.start_planner()
    with pytest.raises(RemoteError, match="told to stop"):
        services.caller.call(keys.SEARCH_START, SearchRequest(("sofa",), age_s=60.0))
    assert services.start("sofa").active


def test_no_driver_obeys_what_was_asked_of_the_one_before(
    services: SimulatedServices, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_planner.searches.EMBED_TIMEOUT_S", 60.0)
    services.restart_driver(named=True, joined=True)
    services.frame()
    with checked(services, SearchRequest(("sofa",), patience_s=60.0)) as started:
        services.restart_driver(named=True, joined=True)
        services.frame()
    with pytest.raises(RemoteError, match="was replaced, or"):
        started.result()


def test_no_drive_begins_on_a_map_that_is_exchanged_in_its_last_moment(
    services: SimulatedServices, monkeypatch: pytest.MonkeyPatch
) -> None:
    services.map_id = "a"
    services.frame()
    registry = services.planner._registry
    start = registry.start

    def late(*arguments: Any) -> Search:
        services.map_id = "b"
        services.frame()
        return start(*arguments)

    monkeypatch.setattr(registry, "start", late)
    with pytest.raises(RemoteError, match="was replaced, or"):
        services.go_to(3.0, 2.0)


def test_a_second_search_is_refused_even_without_perception(services: SimulatedServices) -> None:
    first = services.start("sofa")
    services.perception.close()
    with pytest.raises(RemoteError, match=first.search_id) as refused:
        services.start("bed")
    assert refused.value.code == "conflict"


@pytest.mark.parametrize("procedure", [keys.SEARCH_GET, keys.SEARCH_CANCEL])
@pytest.mark.parametrize("search_id", ["", "nonsense"])
def test_an_unknown_search_is_refused(
    services: SimulatedServices, procedure: keys.Procedure, search_id: str
) -> None:
    with pytest.raises(RemoteError) as refused:
        services.caller.call(procedure, SearchId(search_id))
    assert refused.value.code == "unknown_search"


def test_searches_are_listed_newest_first(services: SimulatedServices) -> None:
    def listed() -> SearchList:
        return services.caller.call(keys.SEARCH_LIST, SearchListRequest())

    assert listed() == SearchList(())
    first = services.start("sofa")
    services.caller.call(keys.SEARCH_CANCEL, SearchId())
    second = services.start("bed")
    assert [each.search_id for each in listed().searches] == [second.search_id, first.search_id]
    assert [each.active for each in listed().searches] == [True, False]
    assert listed().left_out == 0
