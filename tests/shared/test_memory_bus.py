"""What only the bus in memory has; its semantics are held by ``test_bus``, beside Zenoh's."""

from __future__ import annotations

import pytest

from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import Odometry, SearchId
from onemap_shared.transport import NoReply
from onemap_shared.wire import Packet
from tests.shared.samples import SAMPLES

ODOMETRY = next(message for message in SAMPLES if isinstance(message, Odometry))


def test_injected_bytes_arrive_as_from_a_foreign_publisher() -> None:
    router = MemoryRouter()
    subscription = router.bus().subscribe(keys.ROBOT_ODOMETRY)
    router.inject(keys.ROBOT_ODOMETRY.key, Packet(b"no msgpack", b""))
    assert subscription.take(0.0) is None
    assert subscription.counters.refused == 1


def test_messages_are_encoded_and_decoded_as_on_the_wire() -> None:
    router = MemoryRouter()
    subscription = router.bus().subscribe(keys.ROBOT_ODOMETRY)
    router.bus().publish(keys.ROBOT_ODOMETRY).put(ODOMETRY)
    received = subscription.take(0.0)
    assert received is not None
    assert received is not ODOMETRY
    assert not received.T_map_body.flags.writeable


def test_a_closed_bus_is_neither_alive_nor_serving() -> None:
    router = MemoryRouter()
    bus, caller = router.bus("planner"), router.bus()
    bus.serve(keys.SEARCH_GET, lambda _: pytest.fail("a closed bus answers"))
    assert caller.alive() == {"planner"}
    bus.close()
    assert caller.alive() == frozenset()
    with pytest.raises(NoReply, match="search/get"):
        caller.call(keys.SEARCH_GET, SearchId())


def test_a_bus_without_a_service_is_not_announced() -> None:
    router = MemoryRouter()
    assert router.bus().alive() == frozenset()
