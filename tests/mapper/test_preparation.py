"""The mapper's start, as its log and the bus tell it."""

from __future__ import annotations

import logging

import pytest

from onemap_mapper import preparation as module
from onemap_mapper.config import MapperConfig
from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.runner import is_starting


def doubled(value: float) -> float:
    return 2 * value


def test_a_first_start_says_in_log_and_heartbeat_that_it_compiles(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    numba = pytest.importorskip("numba", reason="numba is not installed")
    monkeypatch.setattr(module, "warm_up", lambda _config: numba.njit(doubled)(2.5))
    router = MemoryRouter()
    bus = router.bus("mapper")
    told = [
        client.subscribe(keys.heartbeat("mapper"))
        for client in (router.bus("gateway"), router.bus("gateway").sibling("robot2"))
    ]
    with caplog.at_level(logging.INFO, "onemap.mapper"):
        module.prepare((bus, bus.sibling("robot2")), MapperConfig())
    beat, other = (beats.take(0.0) for beats in told)
    assert beat is not None
    assert other is not None
    assert is_starting(beat)
    assert is_starting(other)
    announced, prepared = caplog.messages
    assert beat.problem.startswith(announced)
    assert announced.startswith("compiling the map's kernels")
    assert "the first frame was prepared in" in prepared


def test_a_later_start_is_silent_on_the_bus(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "warm_up", lambda _config: None)
    router = MemoryRouter()
    beats = router.bus("gateway").subscribe(keys.heartbeat("mapper"))
    module.prepare((router.bus("mapper"),), MapperConfig())
    assert beats.take(0.0) is None
