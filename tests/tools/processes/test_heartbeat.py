"""Health of one service by its heartbeat, as the health check of a container reads it."""

from __future__ import annotations

import threading

from onemap_shared.keys import heartbeat
from onemap_shared.messages import Heartbeat
from onemap_tools.processes.heartbeat import next_heartbeat, problem_of
from tests.memory_bus import MemoryRouter

LONG_S = 60.0


def beat(*, ready: bool, problem: str = "") -> Heartbeat:
    return Heartbeat("mapper", "a", 1, 1, ready, problem)


def test_a_ready_service_has_no_problem() -> None:
    assert problem_of("mapper", beat(ready=True, problem="slow")) == ""


def test_an_unready_service_gives_its_reason() -> None:
    assert problem_of("mapper", beat(ready=False, problem="no frames")).endswith("no frames.")
    assert "does not say why" in problem_of("mapper", beat(ready=False))


def test_silence_is_reported_with_what_to_start() -> None:
    assert next_heartbeat(MemoryRouter().bus(), "mapper", 0.01) is None
    assert "onemap mapper" in problem_of("mapper", None)


def test_the_first_ready_heartbeat_is_enough() -> None:
    router = MemoryRouter()
    mapper = router.bus().publish(heartbeat("mapper"))
    heard: list[Heartbeat | None] = []
    listening = threading.Thread(
        target=lambda: heard.append(next_heartbeat(router.bus(), "mapper", LONG_S))
    )
    listening.start()
    while listening.is_alive():  # until it has subscribed, beats are lost
        mapper.put(beat(ready=False))
        mapper.put(beat(ready=True))
        listening.join(0.01)
    assert heard == [beat(ready=True)]


def test_an_unready_heartbeat_is_returned_after_the_patience() -> None:
    router = MemoryRouter()
    mapper = router.bus().publish(heartbeat("mapper"))
    heard: list[Heartbeat | None] = []
    listening = threading.Thread(
        target=lambda: heard.append(next_heartbeat(router.bus(), "mapper", 1.0))
    )
    listening.start()
    while listening.is_alive():
        mapper.put(beat(ready=False, problem="no frames"))
        listening.join(0.01)
    assert heard == [beat(ready=False, problem="no frames")]
