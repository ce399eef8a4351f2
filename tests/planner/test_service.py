"""The planner on a bus, with a robot and a mapper played by the test."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from onemap_planner.config import PlannerConfig
from onemap_planner.search.journal import FILE_NAME
from onemap_planner.service import Planner
from onemap_shared import keys
from onemap_shared.geometry import pose_2d
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import (
    MapRevision,
    MapSummary,
    Odometry,
    SearchId,
    SearchRequest,
    SearchReset,
    SearchState,
    SearchStatus,
    SearchView,
    SearchViewRequest,
    TextEmbeddings,
    TextRequest,
    VelocityCommand,
)
from onemap_shared.transport import RemoteError, RequestRejected
from onemap_shared.wire import Packet
from tests.planner.drawn_maps import drawn_map, search_view_of

ROOM = drawn_map("##########", *["#........ "] * 8, "##########", scale=5)
STEPS = 400  # of 50 ms each: every wait below ends long before


class House:
    """The planner and, on buses of their own, a robot, a mapper and a caller."""

    def __init__(self, config: PlannerConfig) -> None:
        self.hub = MemoryRouter()
        self.robot, self.mapper, self.caller = (self.hub.bus(name) for name in "rmc")
        self.odometry = self.robot.publish(keys.ROBOT_ODOMETRY)
        self.revisions = self.mapper.publish(keys.MAP_REVISION)
        self.commands = self.robot.subscribe(keys.ROBOT_CMD_VEL, capacity=1000)
        self.states = self.caller.subscribe(keys.SEARCH_STATE, capacity=1000)
        self.paths = self.caller.subscribe(keys.SEARCH_PATH, capacity=1000)
        self.resets: list[str] = []
        self.asked: list[str] = []
        self.answer: Callable[[SearchViewRequest], SearchView] = lambda q: search_view_of(
            ROOM, q.text
        )
        self.mapper.serve(keys.MAP_SEARCH_VIEW, self._view)
        self.mapper.serve(keys.MAP_SEARCH_RESET, self._reset)
        self.perception = self.hub.bus("p")
        self.perception.serve(keys.EMBED_TEXT, self._embed)
        self.config = config
        self.planner = Planner(self.hub.bus("planner"), config)
        self.count = 0

    def _view(self, request: SearchViewRequest) -> SearchView:
        self.asked.append(request.text)
        return self.answer(request)

    def _reset(self, request: SearchReset) -> MapSummary:
        self.resets.append(request.search_id)
        return MapSummary("", "mini", "mini", 0.1, 1, 1)

    def _embed(self, request: TextRequest) -> TextEmbeddings:
        """As an encoder without its sentence encoder: 'flurb' is no word, 'kite' has no place."""
        if "flurb" in request.texts:
            unknown = {"words": [{"word": "flurb", "did_you_mean": ["curb"]}]}
            raise RequestRejected(
                "unknown_word", "'flurb' (did you mean 'curb'?) is no word", unknown
            )
        rows = np.ones((len(request.texts), 1), np.float32)
        nearest = tuple(("ball", "fan") if text == "kite" else () for text in request.texts)
        mask = np.zeros((len(rows), 0), np.uint8)
        return TextEmbeddings(
            "mini", "mini", request.texts, rows, rows[:0], mask, 1.0, 0.2, nearest
        )

    def frame(self, *, odometry: bool = True, revision: bool = True) -> None:
        """One message of each; the planner takes them and waits for its next command."""
        self.count += 1
        stamp_ns = self.count * 50_000_000
        if odometry:
            pose = pose_2d(2.0, 2.0, 0.0)
            self.odometry.put(Odometry(self.count, stamp_ns, pose, 0.0, 0.0))
        if revision:
            self.revisions.put(
                MapRevision(self.count, self.count, stamp_ns, "mini", "mini", 1, 1, 1, 1.0, 4.0)
            )
        self.planner.step(0.0)
        self.planner.step(0.05)

    def until(self, reached: Callable[[], bool], **streams: bool) -> None:
        for _ in range(STEPS):
            if reached():
                return
            self.frame(**streams)
        raise AssertionError("it never happened")

    def start(self, *objects: str) -> SearchStatus:
        return self.caller.call(keys.SEARCH_START, SearchRequest(objects))

    def get(self, search_id: str = "") -> SearchStatus:
        return self.caller.call(keys.SEARCH_GET, SearchId(search_id))

    def driven(self) -> list[VelocityCommand]:
        taken = []
        while (command := self.commands.take(0.0)) is not None:
            taken.append(command)
        return taken


@pytest.fixture
def house() -> Iterator[House]:
    house = House(PlannerConfig())
    yield house
    house.planner.close()


def moves(command: VelocityCommand) -> bool:
    return (command.linear_mps, command.angular_radps) != (0.0, 0.0)


def test_without_a_search_it_keeps_still_and_silent(house: House) -> None:
    for _ in range(5):
        house.frame()
    assert house.driven() == []
    assert house.asked == []
    assert house.planner.health().ready


def test_a_search_moves_the_robot_and_tells_about_it(house: House) -> None:
    told = house.start("sofa", "bed")
    assert told.state is SearchState.EXPLORING
    assert told.target == "sofa"
    house.until(lambda: any(map(moves, house.driven())))
    assert house.resets == [told.search_id]
    assert set(house.asked) == {"sofa"}
    first = house.states.take(0.0)
    assert first is not None
    assert first.search_id == told.search_id
    path = house.paths.take(1.0)
    assert path is not None
    metrics = house.planner.health().metrics or {}
    assert {"plan_ms", "view_age_s", "odometry_age_s", "goals", "stops_on_stale", "control_hz"} <= (
        set(metrics)
    )


@pytest.mark.parametrize(
    ("objects", "word", "near"),
    [(("sofa", "flurb"), "flurb", ["curb"]), (("kite", "sofa"), "kite", ["ball", "fan"])],
)
def test_words_are_checked_before_anything_moves(
    house: House, objects: tuple[str, ...], word: str, near: list[str]
) -> None:
    with pytest.raises(RemoteError, match=f"'{word}' .did you mean '{near[0]}'") as caught:
        house.start(*objects)
    assert caught.value.code == "unknown_word"
    assert caught.value.details == {"words": [{"word": word, "did_you_mean": near}]}
    for _ in range(5):
        house.frame()
    assert house.driven() == []
    assert house.states.take(0.0) is None
    with pytest.raises(RemoteError, match="no search has been started"):
        house.get()


def test_without_perception_no_search_starts(house: House) -> None:
    house.perception.close()
    with pytest.raises(RemoteError, match="words cannot be looked up") as caught:
        house.start("sofa")
    assert caught.value.code == "perception_missing"
    house.frame()
    assert house.states.take(0.0) is None


def test_a_perception_that_hangs_is_named(house: House, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("onemap_planner.search_commands.EMBED_TIMEOUT_S", 0.01)
    released = threading.Event()

    def hang(request: TextRequest) -> TextEmbeddings:
        released.wait(20.0)
        return house._embed(request)

    house.perception.serve(keys.EMBED_TEXT, hang)
    with pytest.raises(RemoteError, match="in time") as caught:
        house.start("sofa")
    released.set()
    assert caught.value.code == "perception_silent"


def test_no_robot_starts_for_a_caller_that_gave_up(house: House) -> None:
    """The words were checked, but too late."""
    patience_s = 0.5 * (keys.SEARCH_START.stale_after_s or 0.0)
    with pytest.raises(RemoteError, match="nothing was started") as caught:
        house.caller.call(keys.SEARCH_START, SearchRequest(("sofa",), patience_s))
    assert caught.value.code == "busy"
    with pytest.raises(RemoteError, match="no search has been started"):
        house.get()


def test_a_second_search_is_refused_even_without_perception(house: House) -> None:
    house.start("sofa")
    house.perception.close()
    with pytest.raises(RemoteError) as refused:
        house.start("bed")
    assert refused.value.code == "conflict"


def test_a_second_search_is_refused_with_the_first_one_s_id(house: House) -> None:
    first = house.start("sofa")
    with pytest.raises(RemoteError, match=first.search_id) as refused:
        house.start("bed")
    assert refused.value.code == "conflict"


def test_a_search_that_is_over_keeps_the_time_of_its_end(house: House) -> None:
    told = house.start("sofa")
    house.until(lambda: house.get().reason != told.reason)
    ended = house.caller.call(keys.SEARCH_CANCEL, SearchId(told.search_id))
    while house.states.take(0.0) is not None:
        pass
    house.until(lambda: (later := house.states.take(0.0)) is not None and later == ended)
    house.start("bed")
    house.frame()
    assert house.get(told.search_id) == ended
    assert house.get().updated_ns > ended.updated_ns


def test_cancel_brakes_and_frees_the_way(house: House) -> None:
    first = house.start("sofa")
    house.until(lambda: any(map(moves, house.driven())))
    assert house.caller.call(keys.SEARCH_CANCEL, SearchId()).state is SearchState.CANCELLED
    house.driven()
    house.frame()
    house.until(lambda: bool(last := house.driven()) and not any(map(moves, last)))
    assert house.get(first.search_id).state is SearchState.CANCELLED
    second = house.start("bed")
    assert second.search_id != first.search_id
    assert house.get(first.search_id).objects == ("sofa",)


@pytest.mark.parametrize("procedure", [keys.SEARCH_GET, keys.SEARCH_CANCEL])
@pytest.mark.parametrize("search_id", ["", "nonsense"])
def test_an_unknown_search_is_refused(
    house: House, procedure: keys.Procedure, search_id: str
) -> None:
    with pytest.raises(RemoteError) as refused:
        house.caller.call(procedure, SearchId(search_id))
    assert refused.value.code == "unknown_search"


@pytest.mark.parametrize("missing", ["odometry", "revision"])
def test_it_stops_when_a_stream_falls_silent_and_says_so(house: House, missing: str) -> None:
    house.start("sofa")
    house.until(lambda: any(map(moves, house.driven())))
    streams = {missing: False}
    house.until(lambda: "waiting:" in house.get().reason, **streams)
    house.driven()
    house.frame(**streams)
    house.frame(**streams)
    assert not any(map(moves, house.driven()))
    problem = house.planner.health().problem
    assert {"odometry": "odometry", "revision": "the map"}[missing] in problem
    house.until(lambda: any(map(moves, house.driven())))  # fresh again: it goes on
    assert "waiting" not in house.get().reason


def test_a_slow_mapper_does_not_hold_up_commands(house: House) -> None:
    house.start("sofa")
    house.until(lambda: any(map(moves, house.driven())))
    asked, release = threading.Event(), threading.Event()

    def slow(request: SearchViewRequest) -> SearchView:
        asked.set()
        release.wait(5.0)
        return search_view_of(ROOM, request.text)

    house.answer = slow
    house.until(asked.is_set)
    house.driven()
    sent: list[VelocityCommand] = []
    while len(sent) < 5:
        house.frame()
        sent += house.driven()
    assert not release.is_set()
    assert any(map(moves, sent))  # the last plan is still young
    release.set()


def test_a_mapper_that_is_gone_is_waited_for(house: House) -> None:
    house.start("sofa")
    house.until(lambda: any(map(moves, house.driven())))
    house.mapper.close()
    house.until(lambda: house.get().reason == "waiting: the mapper is not there")
    back = house.hub.bus("mapper")
    back.serve(keys.MAP_SEARCH_VIEW, house._view)
    back.serve(keys.MAP_SEARCH_RESET, house._reset)
    house.until(lambda: "waiting" not in house.get().reason)
    house.until(lambda: any(map(moves, house.driven())))


def test_a_word_the_map_does_not_know_fails_that_object(house: House) -> None:
    def refuse(request: SearchViewRequest) -> SearchView:
        raise ValueError("the encoder does not know 'qzxw'")

    house.answer = refuse
    house.start("qzxw")
    house.until(lambda: not house.get().active)
    assert house.get().state is SearchState.FAILED
    assert "does not know 'qzxw'" in house.get().reason


def test_bad_names_are_refused_before_anything_moves(house: House) -> None:
    with pytest.raises((RemoteError, ValueError), match="readable word"):
        house.start("!!!")
    house.frame()
    assert house.driven() == []


@pytest.mark.parametrize(
    ("topic", "metric"),
    [
        (keys.ROBOT_ODOMETRY, "odometry_refused"),
        (keys.MAP_REVISION, "revision_refused"),
        (keys.DETECTIONS, "detections_refused"),
    ],
)
def test_garbage_on_its_topics_is_counted_and_passed_over(
    house: House, topic: keys.Topic, metric: str
) -> None:
    house.start("sofa")
    house.hub.inject(topic.key, Packet(b"garbage", b"\x00" * 9))
    house.until(
        lambda: (house.planner.health().metrics or {})[metric] == 1.0,
        odometry=False,
        revision=False,
    )
    house.until(lambda: any(map(moves, house.driven())))


def test_a_killed_planner_goes_on_with_its_search(tmp_path: Path) -> None:
    config = PlannerConfig(state_dir=tmp_path)
    house = House(config)
    told = house.start("sofa", "bed")
    house.until(lambda: (tmp_path / FILE_NAME).exists() and bool(house.resets))
    house.planner._planning_thread.close()  # killed: nothing is tidied up
    house.planner = Planner(house.hub.bus("planner"), config)
    assert house.get().search_id == told.search_id
    house.driven()
    house.until(lambda: any(map(moves, house.driven())))
    assert house.resets == [told.search_id]  # what was searched stays searched
    house.caller.call(keys.SEARCH_CANCEL, SearchId())
    house.until(lambda: not (tmp_path / FILE_NAME).exists())
    house.planner.close()


def test_a_spoilt_record_does_not_keep_it_from_starting(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_text(json.dumps({"schema": 99}))
    house = House(PlannerConfig(state_dir=tmp_path))
    house.frame()
    with pytest.raises(RemoteError):
        house.get()
    house.planner.close()


def test_a_dead_planning_thread_takes_the_process_down(house: House) -> None:
    house.planner._planning_thread.close()
    with pytest.raises(RuntimeError, match="planning thread died"):
        house.planner.step(0.0)


def test_closing_stops_the_robot(house: House) -> None:
    house.start("sofa")
    house.until(lambda: any(map(moves, house.driven())))
    house.planner.close()
    assert not moves(house.driven()[-1])


def test_silence_without_a_search_is_a_problem_after_a_while(house: House) -> None:
    health = house.planner.health()
    assert not health.ready
    assert health.problem == "odometry has never arrived"
    assert np.isfinite(list((health.metrics or {}).values())).all()
