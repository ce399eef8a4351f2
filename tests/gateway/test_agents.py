"""Tools for agents over the Model Context Protocol, and what they say."""

from __future__ import annotations

import base64
import json
import logging
import sys
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from dataclasses import replace
from functools import partial
from typing import Any, Literal

import anyio
import httpx2
import pytest
from pydantic import SecretStr
from starlette.testclient import TestClient

from onemap_gateway.config import GatewayConfig, Role
from onemap_gateway.http.context import GatewayContext
from onemap_gateway.service import GatewayWorker, build
from onemap_shared.messages import After, SearchState
from tests.gateway.fakes import (
    PICTURE,
    FakeMapper,
    FakePlanner,
    decoded,
    find_result,
    gateway_on,
    kept_object,
    search,
)
from tests.memory_bus import MemoryRouter
from tests.structure import ROOT

mcp = pytest.importorskip("mcp", reason="the extra 'mcp' is not installed")
from mcp import Client, types  # noqa: E402
from mcp.client.streamable_http import streamable_http_client  # noqa: E402

from onemap_gateway.http.agent_tools import budget_limits, call_tool  # noqa: E402

CONFIG = GatewayConfig(
    port=0,
    token=SecretStr("all"),
    search_token=SecretStr("move"),
    look_token=SecretStr("look"),
    agent_max_distance_m=40,
)
PATIENCE_S = 60.0  # for an answer; the library's 5 s are a measure of the machine
BUDGET: dict[str, Any] = {"max_distance_m": 30, "max_time_s": 120}


@pytest.fixture
def worker(router: MemoryRouter, mapper: FakeMapper, planner: FakePlanner) -> Iterator[Any]:
    mapper.objects.append(kept_object())
    worker = build(router.bus("gateway"), CONFIG)
    yield worker
    worker.close()


@asynccontextmanager
async def agent(
    worker: GatewayWorker, token: str, mode: Literal["auto", "legacy"] = "auto"
) -> AsyncIterator[Client]:
    address = f"http://127.0.0.1:{worker.port}/mcp"
    headers = {"Authorization": f"Bearer {token}"}
    async with httpx2.AsyncClient(headers=headers, timeout=PATIENCE_S) as http:
        transport = streamable_http_client(address, http_client=http)
        async with Client(transport, mode=mode) as client:
            yield client


def played(worker: GatewayWorker, token: str, *calls: tuple[str, dict[str, Any]]) -> list[Any]:
    """The results of these calls, one after the other."""

    async def play() -> list[Any]:
        async with agent(worker, token) as client:
            return [await client.call_tool(name, arguments) for name, arguments in calls]

    return anyio.run(play)


def text(result: types.CallToolResult) -> str:
    (first, *_rest) = result.content
    assert isinstance(first, types.TextContent)
    return first.text


@pytest.mark.parametrize("mode", ["auto", "legacy"])
def test_agents_of_new_and_old_revisions_see_the_tools(
    worker: GatewayWorker, mode: Literal["auto", "legacy"]
) -> None:
    async def listed() -> dict[str, types.Tool]:
        async with agent(worker, "look", mode) as client:
            await client.call_tool("list_objects", {})
            return {tool.name: tool for tool in (await client.list_tools()).tools}

    tools = anyio.run(listed)
    moving = {
        name
        for name, tool in tools.items()
        if tool.annotations is not None and not tool.annotations.read_only_hint
    }
    assert moving == {"start_search", "go_to", "stop"}
    assert tools.keys() - moving == {
        "where_is", "list_objects", "list_places", "describe_map", "look_at", "search_status",
    }  # fmt: skip
    budget = tools["start_search"].input_schema
    assert budget["properties"]["max_distance_m"]["maximum"] == 40
    assert {"objects", "max_distance_m", "max_time_s"} == set(budget["required"])


def test_an_agent_asks_without_moving_the_robot(
    worker: GatewayWorker, planner: FakePlanner
) -> None:
    where, listed, named, seen, map_shown = played(
        worker,
        "look",
        ("where_is", {"object": "sofa"}),
        ("list_objects", {}),
        ("list_places", {}),
        ("look_at", {"object": "bed"}),
        ("describe_map", {"picture": True}),
    )
    assert where.structured_content["regions"][0]["centre_m"] == [0.35, 1.15]
    assert where.structured_content["regions"][1]["variance"] is None  # infinite
    assert listed.structured_content["objects"][0]["name"] == "bed"
    assert text(named).startswith("Places: 'Kitchen' at x 0.00 m, y 0.00 m (")
    assert base64.b64decode(seen.content[2].data) == PICTURE
    assert seen.content[2].mime_type == "image/jpeg"
    assert decoded(base64.b64decode(map_shown.content[2].data)).shape[2] == 3
    assert planner.requests == []


def test_a_search_is_started_followed_and_stopped(
    worker: GatewayWorker, planner: FakePlanner, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "onemap.gateway")
    started, going, stopped, again = played(
        worker,
        "move",
        ("start_search", {"objects": ["sofa", "kettle"], **BUDGET}),
        ("search_status", {}),
        ("stop", {}),
        ("stop", {"search_id": "s1"}),
    )
    (request,) = planner.requests
    assert (request.max_distance_m, request.max_time_s) == (30, 120)
    assert "at most 30 m and 120 s" in text(started)
    assert going.structured_content["state"] == "exploring"
    assert text(stopped).startswith("Stopped the search s1 for 'sofa', 'kettle'")
    assert stopped.structured_content["state"] == "cancelled"
    assert "nothing to stop" in text(again)
    assert [r.getMessage()[:26] for r in caplog.records if "agent" in r.getMessage()][:2] == [
        "an agent: Started the sear",
        "an agent: Stopped the sear",
    ]


def test_an_agent_sends_the_robot_to_a_place_and_back(
    gateway: GatewayContext, planner: FakePlanner
) -> None:
    summary = said(gateway, "start_search", objects=["sofa"], after="return", **BUDGET)
    assert summary.startswith("Started the search s1 for 'sofa', then back: the robot drives now")
    assert planner.requests[-1].after == After.RETURN
    busy = refusal(gateway, "go_to", place="kitchen", **BUDGET)
    assert busy.startswith("The robot is busy with another search")
    planner.move(SearchState.FOUND)
    summary = said(gateway, "go_to", place="kitchen", **BUDGET)
    assert "the place x 0.00 m, y 0.00 m: the robot drives now, at most 30 m" in summary
    assert planner.requests[-1].place == "kitchen"
    assert planner.requests[-1].max_time_s == 120
    planner.move(SearchState.ARRIVED)
    assert "no place 'attic'" in refusal(gateway, "go_to", place="attic", **BUDGET)
    above = {**BUDGET, "max_distance_m": 1000}
    assert "at most 100 m" in refusal(gateway, "go_to", place="kitchen", **above)


def test_an_agent_gives_the_parts_of_what_it_seeks(
    worker: GatewayWorker, planner: FakePlanner, mapper: FakeMapper
) -> None:
    lamp = {"text": "sofa", "near": "bed", "not_in": "hall"}
    where, started, refused = played(
        worker,
        "move",
        ("where_is", {"object": lamp}),
        ("start_search", {"objects": [lamp, "kettle on the table"], **BUDGET}),
        ("where_is", {"object": "sofa behind the bed"}),
    )
    said = "sofa, within 1 m of a bed, not in the hall (as soon as one is known)"
    assert text(where).startswith(f"Understood as: {said}.")
    assert f"Understood as: {said}; kettle, on a table, anywhere." in text(started)
    (request,) = planner.requests
    assert request.details[0] == mapper.asked[-1].detail
    assert [each.anchors for each in request.details] == [("bed",), ("table",)]
    assert refused.is_error
    assert "'behind the bed' is not understood" in text(refused)


SEARCH = {"objects": ["sofa"], **BUDGET}


@pytest.mark.parametrize(
    ("token", "call", "reason"),
    [
        ("look", ("start_search", SEARCH), "'gateway.search_token'"),
        ("look", ("stop", {}), "may only look"),
        ("all", ("start_search", {**SEARCH, "objects": ["flurb"]}), "did you mean 'curb'"),
        ("move", ("fly", {}), "no tool 'fly': there are where_is"),
    ],
)
def test_what_may_not_be_is_refused_in_a_sentence(
    worker: GatewayWorker,
    planner: FakePlanner,
    token: str,
    call: tuple[str, dict[str, Any]],
    reason: str,
) -> None:
    (result,) = played(worker, token, call)
    assert result.is_error
    assert reason in text(result)
    assert planner.requests == []


def test_the_example_of_the_documents_runs(
    worker: GatewayWorker, capsys: pytest.CaptureFixture[str]
) -> None:
    page = (ROOT / "docs" / "agents.md").read_text(encoding="utf-8")
    example = page.split("```python\n")[1].split("```")[0]
    example = example.replace("127.0.0.1:8080", f"127.0.0.1:{worker.port}")
    exec(compile(example.replace("<token>", "look"), "agents.md", "exec"), {})
    assert "no search confirmed it" in capsys.readouterr().out


@pytest.fixture
def gateway(
    router: MemoryRouter, mapper: FakeMapper, planner: FakePlanner
) -> Iterator[GatewayContext]:
    with gateway_on(router) as gateway:
        yield gateway


def called(
    gateway: GatewayContext, name: str, role: Role = Role.SEARCH, **given: Any
) -> types.CallToolResult:
    return anyio.run(partial(call_tool, gateway, role, name, given))


def said(gateway: GatewayContext, name: str, **given: Any) -> str:
    result = called(gateway, name, **given)
    assert not result.is_error
    return text(result)


def refusal(gateway: GatewayContext, name: str, **given: Any) -> str:
    result = called(gateway, name, **given)
    assert result.is_error
    return text(result)


def test_what_a_search_confirmed_comes_before_what_looks_like_it(
    gateway: GatewayContext, mapper: FakeMapper
) -> None:
    mapper.objects.append(kept_object(name="Sofa"))
    summary = said(gateway, "where_is", object="sofa", max_places=1)
    found = "'Sofa' (3f9a12c4) at x 3.42 m, y -1.15 m was found there by a search."
    told = "'sofa' is at (0.35, 1.15) m."
    assert summary == f"Understood as: sofa, anywhere. {found} {told}"
    assert "Nothing on the map" in said(gateway, "where_is", object="kite")
    assert "does not know 'flurb'" in refusal(gateway, "where_is", object="flurb")


def test_found_objects_are_listed_and_shown_by_name_or_id(
    gateway: GatewayContext, mapper: FakeMapper
) -> None:
    assert "No search has found anything" in said(gateway, "list_objects")
    assert "'start_search' finds it" in refusal(gateway, "look_at", object="bed")
    mapper.objects.append(kept_object())
    assert "'bed' (3f9a12c4)" in said(gateway, "list_objects")
    for name in ("BED", "3f9a12c4"):
        assert said(gateway, "look_at", object=name).startswith("'bed' (3f9a12c4) at x 3.42 m")


def test_a_budget_is_needed_and_has_a_limit(gateway: GatewayContext, planner: FakePlanner) -> None:
    for name, limit, _unit in budget_limits(GatewayConfig()):
        above = {**BUDGET, name: 2 * limit}
        reason = refusal(gateway, "start_search", objects=["sofa"], **above)
        assert f"at most {limit:g}" in reason
        assert "'gateway.agent_max_distance_m'" in reason
        without = {key: value for key, value in BUDGET.items() if key != name}
        assert "is missing" in refusal(gateway, "start_search", objects=["sofa"], **without)
    assert planner.requests == []


def test_without_the_sdk_one_sentence_says_what_to_install(
    client: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "onemap_gateway.http.agent_tools")
    monkeypatch.setitem(sys.modules, "mcp", None)
    answer = client.post("/mcp", json=REQUEST)
    assert answer.status_code == 501
    assert "pip install -e '.[mcp]'" in answer.json()["detail"]


REQUEST = {"jsonrpc": "2.0", "id": 1, "method": "tools/list"}


@pytest.mark.parametrize("body", [b"\xff\xfe", b"[" * 300, json.dumps([REQUEST]).encode(), b"{}"])
def test_what_is_no_message_is_an_error_of_the_protocol(client: TestClient, body: bytes) -> None:
    answer = client.post("/mcp", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == 400
    assert answer.json()["error"]["code"] < 0


def test_a_stop_says_what_it_did(gateway: GatewayContext, planner: FakePlanner) -> None:
    assert "No search" in refusal(gateway, "stop")
    planner.status = replace(search(), results=(find_result("sofa", 1.0, 2.0),))
    summary = said(gateway, "stop")
    assert summary.endswith("the robot brakes and stands. Found: 'sofa'.")
    planner.status = search(state=SearchState.FAILED)
    assert "had ended before as failed: there was nothing to stop" in said(gateway, "stop")
