"""ZenohBus and MemoryBus behave alike: most tests run on both."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import TimeoutError as FutureTimeout
from contextlib import contextmanager
from copy import copy
from dataclasses import replace
from typing import TypeVar

import numpy as np
import pytest

from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.bus import ZenohBus, open_bus
from onemap_shared.config import BusConfig, LinkParams
from onemap_shared.keys import Delivery, Procedure
from onemap_shared.transport import (
    Bus,
    CallError,
    InvalidReply,
    NoReply,
    QueryTimeout,
    RemoteError,
    RequestRejected,
)
from tests.memory_bus import MemoryRouter
from tests.shared.samples import sample

T = TypeVar("T")
PATIENCE_S = 90.0  # for what takes a second on an idle machine; a failure, not a pace
NO_LINK = LinkParams()
ROUTER = """
import sys, threading, signal
from onemap_shared.bus import run_router
stop = threading.Event()
signal.signal(signal.SIGTERM, lambda *_: stop.set())
run_router((sys.argv[1],), stop)
"""


def eventually(attempt: Callable[[], T | None]) -> T:
    """The first result that is not None, or failure after ``PATIENCE_S``."""
    pause, deadline_s = threading.Event(), time.monotonic() + PATIENCE_S
    while (result := attempt()) is None:
        if time.monotonic() > deadline_s:
            raise AssertionError(f"it did not happen within {PATIENCE_S:g} s")
        pause.wait(0.02)
    return result


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


class Router:
    """A router process that can be killed and started again at the same place."""

    def __init__(self) -> None:
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.namespace = ""
        self.process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        self.process = subprocess.Popen([sys.executable, "-c", ROUTER, self.endpoint])

    def kill(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.wait()


@contextmanager
def running() -> Iterator[Router]:
    router = Router()
    router.start()
    yield router
    router.kill()


@pytest.fixture
def router() -> Iterator[Router]:
    with running() as router:
        yield router


@pytest.fixture(scope="module")
def shared_router() -> Iterator[Router]:
    """Of tests that leave it as it is, each with a namespace of its own."""
    with running() as router:
        yield router


@pytest.fixture
def space(shared_router: Router) -> Router:
    """The shared router, in a namespace of this test alone."""
    router = copy(shared_router)
    router.namespace = f"fleet/{uuid.uuid4().hex}"
    return router


def join(router: Router, service: str, namespace: str = "", link: LinkParams = NO_LINK) -> Bus:
    namespace = namespace or router.namespace
    config = BusConfig(connect=(router.endpoint,), namespace=namespace, link=link)
    bus = open_bus(config, service, "test", threading.Event())
    assert bus is not None
    return bus


@pytest.fixture(params=["memory", "zenoh"])
def buses(request: pytest.FixtureRequest) -> Iterator[tuple[Bus, Bus]]:
    pair: tuple[Bus, Bus]
    if request.param == "memory":
        router = MemoryRouter()
        pair = (router.bus("perception"), router.bus("mapper"))
    else:
        space = request.getfixturevalue("space")
        pair = (join(space, "perception"), join(space, "mapper"))
    yield pair
    for bus in pair:
        bus.close()


def summary(name: str) -> m.MapSummary:
    return replace(sample(m.MapSummary), path=name)


def test_a_slow_consumer_gets_the_newest_and_gaps_are_counted(buses: tuple[Bus, Bus]) -> None:
    here, there = buses
    odometry = there.subscribe(keys.ROBOT_ODOMETRY)
    publisher = here.publish(keys.ROBOT_ODOMETRY)

    def attempt() -> m.Odometry | None:
        publisher.put(replace(sample(m.Odometry), sequence=0))
        return odometry.take(0.1)

    eventually(attempt)
    while odometry.take(0.05) is not None:
        pass
    before = odometry.counters.skipped
    for sequence in range(1, 11):
        publisher.put(replace(sample(m.Odometry), sequence=sequence))
    eventually(lambda: odometry.counters.skipped >= before + 9 or None)
    newest = eventually(lambda: sequence_of(odometry.take(0.1), wanted=10))
    assert newest == 10
    assert odometry.counters.missed >= odometry.counters.skipped > 0


def sequence_of(message: m.Odometry | None, wanted: int) -> int | None:
    return message.sequence if message is not None and message.sequence == wanted else None


def test_late_joiners_get_what_is_latched(buses: tuple[Bus, Bus]) -> None:
    here, there = buses
    here.publish(keys.SEARCH_STATE).put(sample(m.SearchStatus))
    assert eventually(lambda: there.subscribe(keys.SEARCH_STATE).take(0.5)) == sample(
        m.SearchStatus
    )


def answered(bus: Bus, name: str) -> m.MapSummary | None:
    try:
        return bus.call(keys.MAP_SAVE, m.MapFile(name), PATIENCE_S)
    except NoReply:  # the declaration is still on its way
        return None


def test_a_call_without_a_server_fails_at_once(buses: tuple[Bus, Bus]) -> None:
    with pytest.raises(NoReply, match="no process serves"):
        buses[0].call(keys.MAP_CLEAR, m.MapClear(), timeout_s=PATIENCE_S)


def test_refusals_travel_with_code_and_sentence(buses: tuple[Bus, Bus]) -> None:
    here, there = buses

    def handler(request: m.MapFile) -> m.MapSummary:
        if request.name == "refused":
            raise RequestRejected(
                "encoder_mismatch", "the map was made by another encoder", {"ours": ["mini"]}
            )
        if request.name == "wrong":
            raise ValueError("that is no name")
        if request.name == "broken":
            raise RuntimeError("a bug")
        return summary(request.name)

    there.serve(keys.MAP_SAVE, handler)
    eventually(lambda: answered(here, "flat"))
    for name, code, sentence in (
        ("refused", "encoder_mismatch", "another encoder"),
        ("wrong", "invalid", "no name"),
        ("broken", "internal", "RuntimeError: a bug"),
    ):
        with pytest.raises(RemoteError, match=sentence) as caught:
            here.call(keys.MAP_SAVE, m.MapFile(name), PATIENCE_S)
        assert caught.value.code == code
        assert caught.value.details == ({"ours": ["mini"]} if name == "refused" else {})
    assert here.call(keys.MAP_SAVE, m.MapFile("flat"), PATIENCE_S) == summary("flat")


def test_an_answer_that_cannot_be_read_is_a_failed_call(buses: tuple[Bus, Bus]) -> None:
    """Of a service of another release, say: no caller has to think of it."""
    here, there = buses
    there.serve(Procedure(keys.MAP_SAVE.key, m.MapFile, m.MapFile), lambda asked: asked)

    def refused() -> CallError | None:
        try:
            here.call(keys.MAP_SAVE, m.MapFile("flat"), PATIENCE_S)
        except NoReply:  # the declaration is still on its way
            return None
        except CallError as problem:
            return problem
        raise AssertionError("it was read")

    problem = eventually(refused)
    assert isinstance(problem, InvalidReply)
    assert keys.MAP_SAVE.key in str(problem)
    assert "packet has schema" in str(problem)


def test_a_request_that_waited_too_long_is_not_carried_out(space: Router) -> None:
    """Its caller may have given up: a robot must not start then."""
    there, here = join(space, "planner"), join(space, "gateway")
    released, served = threading.Event(), []
    start = replace(keys.MAP_SAVE, stale_after_s=1.0)

    def handler(request: m.MapFile) -> m.MapSummary:
        served.append(request.name)
        if request.name == "slow":
            released.wait(PATIENCE_S)
        return summary(request.name)

    there.serve(start, handler)
    eventually(lambda: answered(here, "first"))
    with ThreadPoolExecutor() as pool:
        slow = pool.submit(here.call, start, m.MapFile("slow"), PATIENCE_S)
        eventually(lambda: "slow" in served or None)
        late = pool.submit(here.call, start, m.MapFile("late"), PATIENCE_S)
        with pytest.raises(FutureTimeout):  # longer than a request may wait
            late.result(1.5)
        released.set()
        assert slow.result(PATIENCE_S) == summary("slow")
        with pytest.raises(RemoteError, match="was not carried out") as refused:
            late.result(PATIENCE_S)
    assert refused.value.code == "busy"
    assert served == ["first", "slow"]
    for bus in (here, there):
        bus.close()


@pytest.mark.parametrize("delivery", [Delivery.STATE, Delivery.COMMAND])
def test_a_request_whose_caller_gave_up_is_carried_out_only_if_it_stops(
    space: Router, delivery: Delivery
) -> None:
    there, here = join(space, "planner"), join(space, "gateway")
    released, served = threading.Event(), []
    procedure = replace(keys.MAP_SAVE, delivery=delivery)

    def handler(request: m.MapFile) -> m.MapSummary:
        served.append(request.name)
        if request.name == "slow":
            released.wait(PATIENCE_S)
        return summary(request.name)

    there.serve(procedure, handler)
    eventually(lambda: answered(here, "first"))
    with ThreadPoolExecutor() as pool:
        slow = pool.submit(here.call, procedure, m.MapFile("slow"), PATIENCE_S)
        eventually(lambda: "slow" in served or None)
        with pytest.raises(QueryTimeout):
            here.call(procedure, m.MapFile("late"), 0.2)
        released.set()
        assert slow.result(PATIENCE_S) == summary("slow")
    here.call(procedure, m.MapFile("next"), PATIENCE_S)
    late = ["late"] if delivery is Delivery.COMMAND else []
    assert served == ["first", "slow", *late, "next"]
    for bus in (here, there):
        bus.close()


def test_some_questions_go_to_all_and_one_answer_is_enough(buses: tuple[Bus, Bus]) -> None:
    here, there = buses
    to_all, asked = replace(keys.MAP_SAVE, to_all=True), []

    def refuse(request: m.MapFile) -> m.MapSummary:
        asked.append("here")
        raise RequestRejected("unknown_map", "it is not here")

    def accept(request: m.MapFile) -> m.MapSummary:
        asked.append("there")
        if request.name == "nowhere":
            raise RequestRejected("unknown_map", "it is not there")
        return summary(request.name)

    here.serve(to_all, refuse)
    there.serve(to_all, accept)

    def attempt() -> m.MapSummary | None:
        try:
            reply = here.call(to_all, m.MapFile("flat"), PATIENCE_S)
        except (NoReply, RemoteError):  # a declaration is still on its way
            return None
        return reply if set(asked) == {"here", "there"} else None

    assert eventually(attempt) == summary("flat")
    with pytest.raises(RemoteError, match="it is not"):
        here.call(to_all, m.MapFile("nowhere"), PATIENCE_S)


def test_silence_is_a_timeout(buses: tuple[Bus, Bus]) -> None:
    here, there = buses
    released = threading.Event()

    def handler(request: m.MapFile) -> m.MapSummary:
        if request.name == "slow":
            released.wait(PATIENCE_S)
        return summary(request.name)

    there.serve(keys.MAP_SAVE, handler)
    eventually(lambda: answered(here, "flat"))
    try:
        with pytest.raises(QueryTimeout, match=r"within 0\.2 s"):
            here.call(keys.MAP_SAVE, m.MapFile("slow"), timeout_s=0.2)
    finally:
        released.set()


def test_who_is_alive_is_known_until_it_leaves(buses: tuple[Bus, Bus]) -> None:
    here, there = buses
    eventually(lambda: True if here.alive() == {"perception", "mapper"} else None)
    assert {service for service, _ in here.members()} == {"perception", "mapper"}
    assert ("mapper", there.instance) in here.members()
    there.close()
    eventually(lambda: True if here.alive() == {"perception"} else None)


def test_robots_with_other_namespaces_do_not_hear_each_other(shared_router: Router) -> None:
    one, same, other = (join(shared_router, "planner", name) for name in ("r1", "r1", "r2"))
    near, far = same.subscribe(keys.ROBOT_ODOMETRY), other.subscribe(keys.ROBOT_ODOMETRY)
    publisher = one.publish(keys.ROBOT_ODOMETRY)

    def attempt() -> m.Odometry | None:
        publisher.put(sample(m.Odometry))
        return near.take(0.1)

    eventually(attempt)
    assert far.take(0.2) is None
    for bus in (one, same, other):
        bus.close()


def test_a_restarted_router_brings_everything_back(router: Router) -> None:
    here, there = join(router, "perception"), join(router, "mapper")
    there.serve(keys.MAP_SAVE, lambda request: summary(request.name))
    odometry = there.subscribe(keys.ROBOT_ODOMETRY)
    publisher = here.publish(keys.ROBOT_ODOMETRY)
    eventually(lambda: answered(here, "before"))
    router.kill()
    with pytest.raises((NoReply, QueryTimeout)):
        here.call(keys.MAP_SAVE, m.MapFile("between"), timeout_s=1.0)
    router.start()

    def attempt() -> m.Odometry | None:
        publisher.put(sample(m.Odometry))
        return odometry.take(0.1)

    eventually(attempt)
    assert eventually(lambda: answered(here, "after")) == summary("after")
    here.close()
    there.close()


def test_frames_wait_for_receipts_and_travel_compressed(space: Router) -> None:
    link = LinkParams(compression="lossless", window=1)
    robot, perception = join(space, "robot", link=link), join(space, "perception")
    frames = perception.subscribe(keys.ROBOT_RGBD)
    receipts = perception.publish(keys.RGBD_RECEIPTS)
    publisher = robot.publish(keys.ROBOT_RGBD)

    def put(number: int) -> None:
        publisher.put(replace(sample(m.RgbdFrame), sequence=number))

    def first() -> bool | None:
        """Until both are connected: a receipt before holds nothing back."""
        put(1)
        if frames.take(0.1) is not None:
            receipts.put(m.FrameReceipt(1, 1))
        return robot.metrics()["link_rgbd_receipt_ms"] > 0 or None

    eventually(first)
    put(2)
    received = eventually(lambda: newer(frames.take(0.1), 1))
    assert received.sequence == 2
    np.testing.assert_array_equal(received.rgb, sample(m.RgbdFrame).rgb)
    for number in (3, 4):  # the receipt of 2 is missing
        put(number)
    receipts.put(m.FrameReceipt(2, 1))
    assert eventually(lambda: frames.take(0.1)).sequence == 4
    assert robot.metrics()["link_rgbd_replaced"] >= 1
    assert perception.metrics() == {}
    for bus in (robot, perception):
        bus.close()


def newer(frame: m.RgbdFrame | None, than: int) -> m.RgbdFrame | None:
    return frame if frame is not None and frame.sequence > than else None


def test_one_thread_waits_for_several_topics(buses: tuple[Bus, Bus]) -> None:
    here, there = buses
    arrived = threading.Event()
    odometry = there.subscribe(keys.ROBOT_ODOMETRY, arrived=arrived)
    revisions = there.subscribe(keys.MAP_REVISION, arrived=arrived)
    positions, maps = here.publish(keys.ROBOT_ODOMETRY), here.publish(keys.MAP_REVISION)

    def attempt() -> object:
        positions.put(sample(m.Odometry))
        return odometry.take(0.0) if arrived.wait(0.1) else None

    def attempt_other() -> object:
        arrived.clear()
        maps.put(sample(m.MapRevision))
        return revisions.take(0.0) if arrived.wait(0.1) else None

    eventually(attempt)
    eventually(attempt_other)


def test_a_process_serves_under_the_keys_of_a_second_robot(buses: tuple[Bus, Bus]) -> None:
    """It is seen there, so that no other takes its role."""
    _, mapper = buses
    second = f"{mapper.namespace}2"
    own, other = mapper.sibling(second), mapper.sibling(second)
    assert own.namespace == second
    assert own.members() == frozenset()
    assert own.claim() == ()
    own.serve(keys.MAP_SAVE, lambda request: summary(request.name))
    assert eventually(lambda: answered(other, "flat")) == summary("flat")
    eventually(lambda: other.members() == {("mapper", mapper.instance)} or None)
    with pytest.raises(NoReply):
        mapper.call(keys.MAP_SAVE, m.MapFile("flat"))
    own.close()
    eventually(lambda: other.members() == frozenset() or None)
    other.close()


__all__ = ["router"]  # the fixture


def candidate(router: Router, service: str, instance: str) -> ZenohBus:
    """A process that is connected and not yet announced."""
    config = BusConfig(connect=(router.endpoint,), namespace=router.namespace)
    bus = open_bus(config, service, instance, threading.Event(), announce=False)
    assert bus is not None
    return bus


@pytest.mark.parametrize(("first", "second"), [("planner", "planner"), ("replay", "simulator")])
def test_a_role_is_taken_until_its_process_leaves(space: Router, first: str, second: str) -> None:
    a, b = candidate(space, first, "a"), candidate(space, second, "b")
    assert b.processes() == frozenset()
    assert a.claim() == ()
    assert b.claim() == (f"{first} a",)
    eventually(lambda: a.members() == {(first, "a")} or None)
    a.close()
    eventually(lambda: b.claim() == () or None)
    eventually(lambda: b.members() == {(second, "b")} or None)
    b.close()


def test_without_a_router_nobody_can_be_asked(router: Router) -> None:
    bus = candidate(router, "planner", "a")
    router.kill()
    with pytest.raises(ConnectionError, match="the router does not answer"):
        bus.claim()
    router.start()
    eventually(lambda: claimed(bus))
    bus.close()


def claimed(bus: ZenohBus) -> bool | None:
    try:
        return True if bus.claim() == () else None
    except ConnectionError:
        return None


def test_of_many_that_claim_a_role_at_once_at_most_one_gets_it(space: Router) -> None:
    buses = [candidate(space, "mapper", str(number)) for number in range(4)]
    with ThreadPoolExecutor(len(buses)) as pool:
        for _ in range(5):
            won = [others == () for others in pool.map(ZenohBus.claim, buses)]
            assert sum(won) <= 1
            if any(won):
                break
    for bus in buses:
        bus.close()


def test_a_procedure_may_serve_several_requests_at_once(buses: tuple[Bus, Bus]) -> None:
    here, there = buses
    together = threading.Barrier(3)
    parallel = replace(keys.MAP_SAVE, parallel=3)

    def handler(request: m.MapFile) -> m.MapSummary:
        together.wait(PATIENCE_S)
        return summary(request.name)

    there.serve(parallel, handler)
    eventually(lambda: "mapper" in here.alive() or None)
    with ThreadPoolExecutor(3) as pool:
        asked = [pool.submit(here.call, parallel, m.MapFile(f"m{i}"), 10.0) for i in range(3)]
        assert [each.result(20) for each in asked] == [summary(f"m{i}") for i in range(3)]
