"""A role on the bus belongs to one process at a time."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from onemap_shared.bus import ZenohBus, open_bus
from onemap_shared.config import BusConfig
from tests.shared.test_bus import Router, eventually, router

__all__ = ["router"]  # the fixture


def candidate(router: Router, service: str, instance: str) -> ZenohBus:
    """A process that is connected and not yet announced."""
    config = BusConfig(connect=(router.endpoint,))
    bus = open_bus(config, service, instance, threading.Event(), announce=False)
    assert bus is not None
    return bus


@pytest.mark.parametrize(("first", "second"), [("planner", "planner"), ("replay", "simulator")])
def test_a_role_is_taken_until_its_process_leaves(router: Router, first: str, second: str) -> None:
    a, b = candidate(router, first, "a"), candidate(router, second, "b")
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


def test_of_many_that_claim_a_role_at_once_at_most_one_gets_it(router: Router) -> None:
    buses = [candidate(router, "mapper", str(number)) for number in range(4)]
    with ThreadPoolExecutor(len(buses)) as pool:
        for _ in range(5):
            won = [others == () for others in pool.map(ZenohBus.claim, buses)]
            assert sum(won) <= 1
            if any(won):
                break
    for bus in buses:
        bus.close()
