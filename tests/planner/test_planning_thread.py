"""The planning thread waits for a slow or missing mapper, and the control loop does not."""

from __future__ import annotations

import threading

import pytest

from onemap_shared import keys
from onemap_shared.geometry import pose_2d
from onemap_shared.messages import (
    Detail,
    KeptObject,
    MapRevision,
    ObjectFind,
    Odometry,
    Relation,
    RelationKind,
    SearchRequest,
    SearchState,
    SearchView,
    SearchViewRequest,
    VelocityCommand,
)
from onemap_shared.transport import RequestRejected
from tests.planner.drawn_maps import search_view_of
from tests.planner.one_room import candidate
from tests.planner.simulated_services import CLOCK_NS, ROOM, SimulatedServices, confirm, moves
from tests.shared.samples import SAMPLES

KEPT = next(sample for sample in SAMPLES if isinstance(sample, KeptObject))


def test_a_slow_mapper_does_not_hold_up_commands(services: SimulatedServices) -> None:
    services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))
    asked, release = threading.Event(), threading.Event()

    def slow(request: SearchViewRequest) -> SearchView:
        asked.set()
        release.wait(5.0)
        return search_view_of(ROOM, request.text)

    services.answer = slow
    services.until(asked.is_set)
    services.sent_commands()
    sent: list[VelocityCommand] = []
    while len(sent) < 5:
        services.frame()
        sent += services.sent_commands()
    assert not release.is_set()
    assert any(map(moves, sent))  # the last plan is still young
    release.set()


def test_the_map_is_asked_about_the_anchors_too(services: SimulatedServices) -> None:
    beside = Detail(relations=(Relation(RelationKind.NEXT_TO, ("bed",)),))
    services.caller.call(keys.SEARCH_START, SearchRequest(("sofa",), details=(beside,)))
    services.until(lambda: any(map(moves, services.sent_commands())))
    assert {"sofa", "bed"} <= set(services.asked)
    assert services.get().subject == "'sofa next to a bed'"

    def without_bed(request: SearchViewRequest) -> SearchView:
        if request.text == "bed":
            raise RequestRejected("internal", "it is away")
        return search_view_of(ROOM, request.text)

    services.answer = without_bed
    services.until(lambda: services.get().reason == "waiting for the map: it is away")


def test_a_missing_mapper_is_waited_for(services: SimulatedServices) -> None:
    services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))
    services.mapper.close()
    services.until(lambda: services.get().reason == "waiting for the mapper: it is not running")
    back = services.router.bus("mapper")
    back.serve(keys.MAP_SEARCH_VIEW, services._view)
    back.serve(keys.MAP_SEARCH_RESET, services._reset)
    services.until(lambda: "waiting" not in services.get().reason)
    services.until(lambda: any(map(moves, services.sent_commands())))


def test_a_word_the_map_does_not_know_fails_that_object(services: SimulatedServices) -> None:
    def refuse(request: SearchViewRequest) -> SearchView:
        raise ValueError("the encoder does not know 'qzxw'")

    services.answer = refuse
    services.start("qzxw")
    services.until(lambda: not services.get().active)
    assert services.get().state is SearchState.FAILED
    assert "does not know 'qzxw'" in services.get().reason


def test_a_dead_planning_thread_takes_the_process_down(services: SimulatedServices) -> None:
    services.planner._planning_thread.close()
    with pytest.raises(RuntimeError, match="planning thread died"):
        services.planner.step(0.0)


def steps(services: SimulatedServices, count: int) -> None:
    for _ in range(count):
        services.planner.step(0.01)


def test_a_planning_thread_that_hangs_takes_the_process_down(
    services: SimulatedServices, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_shared.watchdog.HANG_LIMIT_S", 0.2)
    planning, release = threading.Event(), threading.Event()

    def hang(*_: object) -> None:
        planning.set()
        release.wait(60.0)

    monkeypatch.setattr(services.planner._planning_thread, "_plan", hang)
    services.start("sofa")
    assert planning.wait(60.0)
    with pytest.raises(RuntimeError, match="the planning thread has made no progress"):
        steps(services, 1000)
    release.set()


def found_sofa(services: SimulatedServices) -> None:
    """A search that has found its sofa; no mapper keeps it yet."""
    services.start("sofa")
    confirm(services.planner, candidate(2.5, 2.0))
    services.until(lambda: not services.get().active)
    assert services.get().state is SearchState.FOUND


def test_a_find_is_sent_until_the_mapper_takes_it(services: SimulatedServices) -> None:
    taken: list[ObjectFind] = []

    def remember(find: ObjectFind) -> KeptObject:
        taken.append(find)
        return KEPT

    found_sofa(services)
    services.mapper.serve(keys.MAP_REMEMBER, remember)
    services.until(lambda: bool(taken))
    (sofa,) = taken
    assert (sofa.name, sofa.position_m) == ("sofa", (2.5, 2.0, 0.5))
    assert sofa.search_id == services.get().search_id
    assert services.planner._planning_thread._finds._oldest() is None


def test_a_find_on_a_map_that_was_cleared_is_dropped(services: SimulatedServices) -> None:
    found_sofa(services)
    outbox = services.planner._planning_thread._finds
    assert outbox._oldest() is not None
    services.count += 1000  # the same mapper counts on, with an empty map
    cleared = MapRevision(services.count, 0, 0, "mini", "mini", 0, 0, 1, 1.0, 4.0)
    services.revisions.put(cleared)
    services.frame(revision=False)
    assert outbox._oldest() is None


def test_a_find_outlives_a_restart_of_the_mapper(services: SimulatedServices) -> None:
    found_sofa(services)
    services.count = 0
    services.revisions.put(MapRevision(0, 0, 0, "mini", "mini", 0, 0, 1, 1.0, 4.0))
    services.frame(revision=False)
    assert services.planner._inputs.map_count == 2
    assert services.planner._planning_thread._finds._oldest() is not None


def test_a_pose_bomb_stops_the_robot_with_a_reason(services: SimulatedServices) -> None:
    services.start("sofa")
    services.until(lambda: any(map(moves, services.sent_commands())))

    def bomb() -> bool:
        pose = pose_2d(90_000.0, 90_000.0, 0.0)
        stamp_ns = CLOCK_NS + services.count * 50_000_000
        services.odometry.put(Odometry(services.count, stamp_ns, pose, 0.0, 0.0))
        services.planner.step(0.0)
        return "m outside the map" in services.get().reason

    services.until(bomb, odometry=False)
    assert services.planner._planning_thread.alive
    services.until(lambda: "waiting" not in services.get().reason)
