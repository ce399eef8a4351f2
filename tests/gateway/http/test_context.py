"""Calls through the gateway: a failure becomes a problem that names the service."""

from __future__ import annotations

from typing import Any

import anyio
import pytest

from onemap_gateway.config import GatewayConfig
from onemap_gateway.http.problems import HttpProblem
from onemap_shared import keys
from onemap_shared.keys import Procedure
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import MapClear, MapSummary
from onemap_shared.transport import RequestRejected
from tests.gateway import fakes
from tests.gateway.fakes import FakePlanner, gateway_on


def call_problem(
    router: MemoryRouter, procedure: Procedure[Any, Any] = keys.SEARCH_GET
) -> HttpProblem:
    """The problem that a call of ``procedure`` ends with."""
    with gateway_on(router) as gateway, pytest.raises(HttpProblem) as problem:
        anyio.run(gateway.call, procedure, procedure.request())
    return problem.value


def hang(router: MemoryRouter, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every service pass for one that hangs."""
    monkeypatch.setattr(
        "onemap_gateway.http.context.hung_problem", lambda name, _state, _now_s: f"{name} hangs."
    )


def test_an_absent_service_is_unavailable(router: MemoryRouter) -> None:
    problem = call_problem(router)
    assert (problem.code, problem.extra["service"]) == ("unavailable", "planner")


def test_a_refusal_keeps_its_code(router: MemoryRouter, planner: FakePlanner) -> None:
    assert call_problem(router).code == "unknown_search"


def test_an_absent_service_that_hangs_is_a_timeout(
    router: MemoryRouter, monkeypatch: pytest.MonkeyPatch
) -> None:
    hang(router, monkeypatch)
    problem = call_problem(router)
    assert (problem.code, problem.extra["service"]) == ("timeout", "planner")
    assert problem.detail == "planner hangs."


def test_a_hung_service_behind_the_one_called_is_named(
    router: MemoryRouter, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_request: MapClear) -> MapSummary:
        raise RequestRejected("perception_missing", "perception does not run")

    hang(router, monkeypatch)
    router.bus("mapper").serve(keys.MAP_CLEAR, refuse)
    problem = call_problem(router, keys.MAP_CLEAR)
    assert (problem.code, problem.extra["service"]) == ("timeout", "perception")
    assert problem.detail == "perception hangs."


def test_the_map_is_asked_for_with_the_text(router: MemoryRouter, mapper: fakes.FakeMapper) -> None:
    with gateway_on(router, GatewayConfig()) as gateway:
        assert anyio.run(gateway.view, "sofa").text == "sofa"
        assert anyio.run(gateway.view).text == ""
