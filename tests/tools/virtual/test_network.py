"""The bus in virtual time: calls, links that are late or cut, a router that comes back."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import pytest

from onemap_shared import keys
from onemap_shared.messages import MapRevision, Odometry, SearchId, SearchStatus
from onemap_shared.transport import NoReply, QueryTimeout, RemoteError, RequestRejected
from onemap_tools.virtual.network import VirtualBus, VirtualRouter
from onemap_tools.virtual.scheduler import Process, VirtualWorld
from tests.gateway import fakes


def odometry(sequence: int) -> Odometry:
    return Odometry(sequence, sequence, np.eye(4), 0.0, 0.0)


@dataclass
class Net:
    """Sessions of two processes on one router."""

    world: VirtualWorld
    router: VirtualRouter
    robot: VirtualBus
    planner: VirtualBus
    heard: list[object] = field(default_factory=list)

    def run(self, work: Callable[[], object], until_s: float = 60.0) -> None:
        self.world.spawn(self.planner.process, "work", work)
        self.world.run(until_s)
        assert self.world.crashes == []


@pytest.fixture
def net() -> Iterator[Net]:
    world = VirtualWorld(1, preempt=0.2)
    router = VirtualRouter(world)
    robot, planner = (router.join(world.process(name), name) for name in ("simulator", "planner"))
    yield Net(world, router, robot, planner)
    world.close()


def test_what_is_sent_arrives_in_order_after_the_delay(net: Net) -> None:
    net.robot.up.delay_s, net.robot.up.jitter_s = 0.2, 0.1
    inbox = net.planner.subscribe(keys.ROBOT_ODOMETRY, capacity=9)
    publisher = net.robot.publish(keys.ROBOT_ODOMETRY)

    def work() -> None:
        for number in range(5):
            publisher.put(odometry(number))
        while (message := inbox.take(1.0)) is not None:
            net.heard.append(message.sequence)

    net.run(work)
    assert net.heard == [0, 1, 2, 3, 4]
    assert 1.2 <= net.world.now_s <= 1.4


def test_the_newest_latched_message_reaches_who_comes_later(net: Net) -> None:
    def work() -> None:
        publisher = net.robot.publish(keys.MAP_REVISION)
        for number in (3, 4):
            publisher.put(fakes.revision(number))
        net.planner.clock.sleep(1.0)
        inbox = net.planner.subscribe(keys.MAP_REVISION)
        message: MapRevision | None = inbox.take(1.0)
        net.heard.append(message.revision if message else None)

    net.run(work)
    assert net.heard == [4]


def outcome(net: Net, timeout_s: float = 2.0) -> object:
    try:
        return net.planner.call(keys.SEARCH_GET, SearchId("a"), timeout_s).search_id
    except (NoReply, QueryTimeout) as problem:
        return type(problem)
    except RemoteError as problem:
        return problem.code


def test_calls_are_answered_refused_late_or_without_a_server(net: Net) -> None:
    def serve(request: SearchId) -> SearchStatus:
        if net.heard == ["unknown"]:
            net.robot.clock.sleep(5.0)
        raise RequestRejected("unknown", request.search_id)

    def work() -> None:
        net.heard.clear()
        first = outcome(net)
        net.robot.serve(keys.SEARCH_GET, serve)
        net.heard.append(outcome(net))
        late = outcome(net, 1.0)
        net.world.at(0.5, lambda: net.world.kill(net.robot.process))
        net.heard[:] = [first, *net.heard, late, outcome(net, 3.0), outcome(net)]

    net.run(work)
    assert net.heard == [NoReply, "unknown", QueryTimeout, NoReply, NoReply]


@pytest.mark.parametrize(("cut_s", "arrives"), [(1.0, True), (5.0, False)])
def test_what_a_cut_link_holds_arrives_unless_the_lease_ends(
    net: Net, cut_s: float, arrives: bool
) -> None:
    inbox = net.planner.subscribe(keys.ROBOT_ODOMETRY)
    publisher = net.robot.publish(keys.ROBOT_ODOMETRY)

    def work() -> None:
        net.planner.clock.sleep(1.0)
        net.heard.append(net.planner.alive())
        net.router.cut(net.robot.process, cut=True)
        publisher.put(odometry(1))
        net.planner.clock.sleep(cut_s)
        net.heard.append(net.planner.alive())
        net.router.cut(net.robot.process, cut=False)
        net.heard.append(inbox.take(1.0) is not None)
        net.planner.clock.sleep(3.0)
        net.heard.append(net.planner.alive())

    net.run(work)
    both = frozenset({"simulator", "planner"})
    assert net.heard == [both, both if arrives else frozenset({"planner"}), arrives, both]


def test_what_is_sent_arrives_though_its_process_ends(net: Net) -> None:
    net.robot.up.delay_s = 0.5
    inbox = net.planner.subscribe(keys.ROBOT_ODOMETRY, capacity=9)

    def work() -> None:
        net.planner.clock.sleep(1.0)
        net.robot.publish(keys.ROBOT_ODOMETRY).put(odometry(1))
        net.world.kill(net.robot.process)
        net.planner.clock.sleep(0.4)
        net.heard.append(net.planner.alive())
        net.heard.append(inbox.take(0.2) is not None)
        net.planner.clock.sleep(0.1)
        net.heard.append(net.planner.alive())

    net.run(work)
    assert net.heard == [{"simulator", "planner"}, True, {"planner"}]


def test_what_a_link_loses_is_sent_anew(net: Net) -> None:
    net.robot.up.loss = 0.5
    inbox = net.planner.subscribe(keys.ROBOT_ODOMETRY, capacity=99)
    publisher = net.robot.publish(keys.ROBOT_ODOMETRY)
    late: list[float] = []

    def work() -> None:
        for number in range(30):
            publisher.put(odometry(number))
            sent_s = net.world.now_s
            message = inbox.take(20.0)
            net.heard.append(message.sequence if message else None)
            late.append(net.world.now_s - sent_s)

    net.run(work, 600.0)
    assert net.heard == list(range(30))
    assert max(late) > 0.2
    assert sorted(late)[5] < 0.01


def test_only_what_is_published_is_dropped_by_a_full_link(net: Net) -> None:
    inbox = net.planner.subscribe(keys.ROBOT_ODOMETRY, capacity=99)
    publisher = net.robot.publish(keys.ROBOT_ODOMETRY)
    other = net.router.join(net.world.process("mapper"), "mapper", announce=False)

    def work() -> None:
        net.robot.up.bytes_per_s, net.robot.up.queue_bytes = 1000.0, 500.0
        other.up.bytes_per_s, other.up.queue_bytes = 10.0, 500.0
        for number in range(20):
            publisher.put(odometry(number))
        other.publish(keys.MAP_REVISION).put(fakes.revision(1))
        other.announce()
        net.planner.clock.sleep(60.0)
        while (message := inbox.take(0.0)) is not None:
            net.heard.append(message.sequence)
        net.heard.append("mapper" in net.planner.alive())

    net.run(work, 100.0)
    assert net.heard[-1] is True
    assert 1 <= len(net.heard) - 1 < 20


def test_what_waits_leaves_as_fast_as_the_link_is_by_then(net: Net) -> None:
    inbox = net.planner.subscribe(keys.ROBOT_ODOMETRY, capacity=99)
    publisher = net.robot.publish(keys.ROBOT_ODOMETRY)

    def work() -> None:
        net.robot.change_link(bytes_per_s=1.0)
        for number in range(5):
            publisher.put(odometry(number))
        net.planner.clock.sleep(1.0)
        assert inbox.take(0.0) is None
        net.robot.change_link(bytes_per_s=1e9)
        net.planner.clock.sleep(0.1)
        while (message := inbox.take(0.0)) is not None:
            net.heard.append(message.sequence)

    net.run(work)
    assert net.heard == [0, 1, 2, 3, 4]


def test_a_suspended_computer_counts_its_pause(net: Net) -> None:
    clock = net.robot.clock

    def ages() -> tuple[float, float, float]:
        return clock.monotonic_s(), clock.suspended_s(), clock.wall_ns() * 1e-9

    def work() -> None:
        before = ages()
        net.router.stall(net.robot.process, stalled=True)
        net.planner.clock.sleep(70.0)
        net.router.stall(net.robot.process, stalled=False, suspended=True)
        for now, then in zip(ages(), before, strict=True):
            net.heard.append(round(now - then))

    net.run(work, 100.0)
    assert net.heard == [0, 70, 70]


def test_a_router_that_comes_back_is_found_again(net: Net) -> None:
    def work() -> None:
        net.planner.clock.sleep(0.5)
        net.router.stop()
        net.planner.clock.sleep(0.5)
        net.heard.append((net.planner.connected(), net.planner.alive(), outcome(net)))
        net.router.start()
        net.planner.clock.sleep(3.0)
        net.heard.append((net.planner.connected(), net.planner.alive()))

    net.run(work)
    assert net.heard == [
        (False, frozenset(), NoReply),
        (True, frozenset({"simulator", "planner"})),
    ]


def test_one_of_two_processes_of_a_role_stays(net: Net) -> None:
    second: Process = net.world.process("planner")
    other = net.router.join(second, "planner", announce=False)

    def work() -> None:
        net.planner.clock.sleep(0.5)
        net.heard.append(other.claim())
        net.world.kill(net.planner.process)

    def again() -> None:
        other.clock.sleep(1.0)
        net.heard.append(other.claim())

    net.world.spawn(second, "again", again)
    net.world.spawn(second, "claim", work)
    net.world.run(10.0)
    assert net.heard == [(f"planner {net.planner.instance}",), ()]
