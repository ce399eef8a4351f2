"""What the tools of agents do, without the protocol around them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import anyio
import pytest

from onemap_gateway.config import GatewayConfig, Role
from onemap_gateway.http.agent_tools import TOOLS, ToolResult, budget_limits, call_tool
from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.problems import HttpProblem
from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import SearchState
from tests.gateway.fakes import (
    FakeMapper,
    FakePlanner,
    find_result,
    gateway_on,
    kept_object,
    odometry,
    search,
    state_reached,
)

BUDGET: dict[str, Any] = {"max_distance_m": 30.0, "max_time_s": 120.0}


@pytest.fixture
def gateway(
    router: MemoryRouter, mapper: FakeMapper, planner: FakePlanner
) -> Iterator[GatewayContext]:
    with gateway_on(router) as gateway:
        yield gateway


def called(
    gateway: GatewayContext, name: str, role: Role = Role.SEARCH, **given: Any
) -> ToolResult:
    return anyio.run(partial(call_tool, gateway, role, name, given))


def refusal(gateway: GatewayContext, name: str, role: Role = Role.SEARCH, **given: Any) -> str:
    with pytest.raises(HttpProblem) as problem:
        called(gateway, name, role, **given)
    return problem.value.detail


def test_what_a_search_confirmed_comes_before_what_looks_like_it(
    gateway: GatewayContext, mapper: FakeMapper
) -> None:
    mapper.objects.append(kept_object(name="Sofa"))
    reply = called(gateway, "where_is", object="sofa", max_places=1).reply
    assert reply.summary.startswith("'Sofa' (3f9a12c4) at x 3.42 m, y -1.15 m was found")
    assert "look like 'sofa'" in reply.summary
    assert "Nothing on the map" in called(gateway, "where_is", object="kite").reply.summary
    assert "does not know 'flurb'" in refusal(gateway, "where_is", object="flurb")


def test_found_objects_are_listed_and_shown_by_name_or_id(
    gateway: GatewayContext, mapper: FakeMapper
) -> None:
    assert "No search has found anything" in called(gateway, "list_objects").reply.summary
    assert "'start_search' finds it" in refusal(gateway, "look_at", object="bed")
    mapper.objects.append(kept_object())
    assert "'bed' (3f9a12c4)" in called(gateway, "list_objects").reply.summary
    for name in ("BED", "3f9a12c4"):
        shown = called(gateway, "look_at", object=name)
        assert (shown.picture, shown.media_type) == (mapper.picture, "image/jpeg")


def test_the_map_is_described_with_the_robot_on_it(
    gateway: GatewayContext, router: MemoryRouter
) -> None:
    described = called(gateway, "describe_map", Role.LOOK)
    assert "3.0 m2 of free floor" in described.reply.summary
    assert "no pose of the robot is known" in described.reply.summary
    assert "No camera frame has arrived" in described.reply.summary
    assert described.picture == b""
    router.bus("simulator").publish(keys.ROBOT_ODOMETRY).put(odometry(1.0, -2.0, 0.5))
    assert state_reached(gateway.cache, lambda state: state.odometry is not None)
    assert "stands at x 1.00 m, y -2.00 m" in called(gateway, "describe_map").reply.summary


def test_a_budget_is_needed_and_has_a_limit(gateway: GatewayContext, planner: FakePlanner) -> None:
    for name, limit, _unit in budget_limits(GatewayConfig()):
        above = {**BUDGET, name: 2 * limit}
        reason = refusal(gateway, "start_search", objects=["sofa"], **above)
        assert f"at most {limit:g}" in reason
        assert "'gateway.agent_max_distance_m'" in reason
        without = {key: value for key, value in BUDGET.items() if key != name}
        assert "is missing" in refusal(gateway, "start_search", objects=["sofa"], **without)
    assert planner.requests == []


def test_one_search_at_a_time(gateway: GatewayContext) -> None:
    called(gateway, "start_search", objects=["sofa"], **BUDGET)
    assert "busy" in refusal(gateway, "start_search", objects=["kettle"], **BUDGET)


def test_progress_says_what_was_found(gateway: GatewayContext, planner: FakePlanner) -> None:
    none = called(gateway, "search_status").reply.summary
    assert none == called(gateway, "stop").reply.summary
    assert "has been no search" in none
    planner.status = search(state=SearchState.FOUND)
    object.__setattr__(planner.status, "results", (find_result("sofa", 1.0, 2.0),))
    progress = called(gateway, "search_status", search_id="s1").reply.summary
    assert "is found after" in progress
    assert progress.endswith("Found: 'sofa'.")
    assert "s2" in refusal(gateway, "search_status", search_id="s2")
    assert "search_id" in refusal(gateway, "stop", search_id="a/b")


def test_a_missing_service_is_named(router: MemoryRouter) -> None:
    with gateway_on(router) as gateway:
        assert "planner" in refusal(gateway, "stop")
        assert "planner" in refusal(gateway, "start_search", objects=["sofa"], **BUDGET)


def test_who_may_only_look_moves_nothing(gateway: GatewayContext, planner: FakePlanner) -> None:
    for name, tool in TOOLS.items():
        if tool.changes:
            assert "'gateway.search_token'" in refusal(gateway, name, Role.LOOK)
    assert planner.requests == []
