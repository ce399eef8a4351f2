"""The cache of the bus's latest messages."""

from __future__ import annotations

import logging

import pytest

from onemap_gateway.bus.state_cache import StateCache
from onemap_gateway.present.service_status import hung_problem
from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.wire import Packet, encode
from tests.gateway import fakes
from tests.gateway.fakes import state_reached


def test_every_stream_arrives(router: MemoryRouter) -> None:
    cache, robot = StateCache(router.bus("gateway")), router.bus("simulator")
    robot.publish(keys.ROBOT_RGBD).put(fakes.rgbd())
    robot.publish(keys.ROBOT_ODOMETRY).put(fakes.odometry(1, 2))
    robot.publish(keys.ROBOT_CMD_VEL).put(fakes.command())
    robot.publish(keys.DETECTIONS).put(fakes.detections("sofa"))
    robot.publish(keys.MAP_REVISION).put(fakes.revision(1))
    robot.publish(keys.SEARCH_STATE).put(fakes.search())
    robot.publish(keys.SEARCH_PATH).put(fakes.planned_path((0, 0)))
    robot.publish(keys.heartbeat("mapper")).put(fakes.heartbeat("mapper"))
    streams = ("frame", "odometry", "detections", "revision", "search", "path")
    heard = state_reached(
        cache,
        lambda state: (
            bool(state.heartbeats)
            and all(getattr(state, name) for name in streams)
            and cache.counters()["command"].received > 0
        ),
    )
    cache.close()
    assert heard
    assert all(counters.received == 1 for counters in cache.counters().values())


def test_liveliness_tokens_are_followed(router: MemoryRouter) -> None:
    cache = StateCache(router.bus("gateway"))
    mapper = router.bus("mapper")
    assert state_reached(cache, lambda state: "mapper" in state.alive)
    mapper.close()
    assert state_reached(cache, lambda state: "mapper" not in state.alive)
    cache.close()


def test_no_change_of_a_search_is_lost(router: MemoryRouter) -> None:
    cache = StateCache(router.bus("gateway"))
    publisher = router.bus("planner").publish(keys.SEARCH_STATE)
    for index in range(10):
        publisher.put(fakes.search(updated_ns=index))
    assert state_reached(cache, lambda state: state.search_count == 10)
    assert [status.updated_ns for status in cache.state.search_log] == list(range(10))
    cache.close()


def test_a_broken_message_is_logged_and_passed_over(
    router: MemoryRouter, caplog: pytest.LogCaptureFixture
) -> None:
    cache = StateCache(router.bus("gateway"))
    good = encode(fakes.odometry(1, 2))
    with caplog.at_level(logging.WARNING, "onemap.gateway"):
        router.inject(keys.ROBOT_ODOMETRY.key, Packet(good.header, good.body[:-1]))
        assert state_reached(cache, lambda _state: cache.counters()["odometry"].refused == 1)
        router.inject(keys.ROBOT_ODOMETRY.key, good)
        assert state_reached(cache, lambda state: state.odometry is not None)
    cache.close()
    assert cache.counters()["odometry"].refused == 1
    assert any("odometry: message refused" in record.message for record in caplog.records)


def test_streams_see_that_the_gateway_closes_before_it_is_closed(router: MemoryRouter) -> None:
    cache = StateCache(router.bus("gateway"))
    before = cache.closing
    cache.begin_close()
    after = cache.closing
    cache.close()
    assert (before, after) == (False, True)


def test_a_service_hangs_if_it_was_silent_before_its_token_went(router: MemoryRouter) -> None:
    now_s = [10.0]
    mapper = router.bus("mapper")
    cache = StateCache(router.bus("gateway"), clock_s=lambda: now_s[0])
    mapper.publish(keys.heartbeat("mapper")).put(fakes.heartbeat("mapper"))
    assert state_reached(cache, lambda state: "mapper" in state.heartbeats)
    assert state_reached(cache, lambda state: "mapper" in state.alive)
    now_s[0] = 12.5
    assert hung_problem("mapper", cache.state_with_fresh_liveliness(), 12.5) == ""
    mapper.close()
    fresh = cache.state_with_fresh_liveliness()  # before the next poll of the tokens
    assert "its process hangs" in hung_problem("mapper", fresh, 12.5)
    cache.close()
