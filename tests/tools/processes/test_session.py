"""Sessions of commands on the bus, and the health of one service by its heartbeat."""

from __future__ import annotations

import logging
import threading

import pytest

from onemap_shared.config import BusConfig
from onemap_shared.keys import heartbeat
from onemap_shared.messages import Heartbeat
from onemap_tools.errors import CliError
from onemap_tools.processes.network import any_free_port
from onemap_tools.processes.session import connect, next_heartbeat, temporary_session
from tests.memory_bus import MemoryRouter
from tests.shared.test_bus import PATIENCE_S, Router, eventually, router

__all__ = ["router"]  # the fixture


def test_without_a_router_the_wait_ends_and_only_the_wait_is_silent(
    caplog: pytest.LogCaptureFixture,
) -> None:
    endpoint = f"tcp/127.0.0.1:{any_free_port()}"
    config = BusConfig(connect=(endpoint,))
    with (
        pytest.raises(CliError, match=f"No router at {endpoint}"),
        temporary_session(config, "status", 0.1),
    ):
        pass
    assert caplog.text == ""
    logging.getLogger("onemap.bus").warning("the link is slow")
    assert "the link is slow" in caplog.text


def test_a_session_leaves_the_bus_at_its_end(router: Router) -> None:
    config = BusConfig(connect=(router.endpoint,))
    observer = connect(config, "observer", "o", PATIENCE_S)
    assert observer is not None
    with temporary_session(config, "doctor", PATIENCE_S):
        assert eventually(lambda: "doctor" in observer.alive() or None)
    assert eventually(lambda: "doctor" not in observer.alive() or None)
    observer.close()


def beat(*, ready: bool, problem: str = "") -> Heartbeat:
    return Heartbeat("mapper", "a", 1, 1, ready, problem)


@pytest.mark.parametrize(("ready", "patience_s"), [(True, 60.0), (False, 0.2)])
def test_the_first_ready_heartbeat_is_enough(ready: bool, patience_s: float) -> None:
    """One that is not ready is returned after the patience, and none without any."""
    bus_router = MemoryRouter()
    mapper, bus = bus_router.bus().publish(heartbeat("mapper")), bus_router.bus()
    heard: list[Heartbeat | None] = []
    listening = threading.Thread(
        target=lambda: heard.append(next_heartbeat(bus, "mapper", patience_s))
    )
    listening.start()
    while listening.is_alive():  # until it has subscribed, beats are lost
        mapper.put(beat(ready=False))
        mapper.put(beat(ready=ready))
        listening.join(0.01)
    assert heard == [beat(ready=ready)]
    assert next_heartbeat(bus, "planner", 0.01) is None
