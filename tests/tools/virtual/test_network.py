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
