"""The tools as the official client of the protocol sees them, on a real gateway on loopback."""

from __future__ import annotations

import base64
import logging
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager
from typing import Any, Literal

import anyio
import httpx2
import pytest
from pydantic import SecretStr

from onemap_gateway.config import GatewayConfig
from onemap_gateway.service import GatewayWorker, build
from onemap_shared.memory_bus import MemoryRouter
from tests.gateway.fakes import PICTURE, FakeMapper, FakePlanner, decoded, kept_object
from tests.structure import ROOT

mcp = pytest.importorskip("mcp", reason="the extra 'mcp' is not installed")
from mcp import Client, types  # noqa: E402
from mcp.client.streamable_http import streamable_http_client  # noqa: E402

CONFIG = GatewayConfig(
    port=0,
    token=SecretStr("all"),
    search_token=SecretStr("move"),
    look_token=SecretStr("look"),
    agent_max_distance_m=40,
)
PATIENCE_S = 60.0  # for an answer; the library's 5 s are a measure of the machine
BUDGET = {"max_distance_m": 30, "max_time_s": 120}
Script = Callable[[Client], Awaitable[Any]]


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
    assert moving == {"start_search", "stop"}
    assert set(tools) - moving == {
        "where_is",
        "list_objects",
        "describe_map",
        "look_at",
        "search_status",
    }
    budget = tools["start_search"].input_schema
    assert budget["properties"]["max_distance_m"]["maximum"] == 40
    assert {"objects", "max_distance_m", "max_time_s"} == set(budget["required"])


def test_an_agent_asks_without_moving_the_robot(
    worker: GatewayWorker, planner: FakePlanner
) -> None:
    where, listed, seen, map_shown = played(
        worker,
        "look",
        ("where_is", {"object": "sofa"}),
        ("list_objects", {}),
        ("look_at", {"object": "bed"}),
        ("describe_map", {"picture": True}),
    )
    assert where.structured_content["likely"][0]["centre_m"] == [0.35, 1.15]
    assert where.structured_content["likely"][1]["variance"] is None  # infinite
    assert listed.structured_content["objects"][0]["name"] == "bed"
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
        ("start_search", {"objects": ["sofa", "kettle"], "order": "any", **BUDGET}),
        ("search_status", {}),
        ("stop", {}),
        ("stop", {"search_id": "s1"}),
    )
    (request,) = planner.requests
    assert (request.max_distance_m, request.max_time_s) == (30, 120)
    assert "at most 30 m and 120 s" in text(started)
    assert going.structured_content["search"]["state"] == "exploring"
    assert text(stopped).startswith("Stopped the search s1 for 'sofa', 'kettle'")
    assert stopped.structured_content["search"]["state"] == "cancelled"
    assert "nothing to stop" in text(again)
    assert [r.getMessage()[:26] for r in caplog.records if "agent" in r.getMessage()][:2] == [
        "an agent: Started the sear",
        "an agent: Stopped the sear",
    ]


SEARCH = {"objects": ["sofa"], **BUDGET}


@pytest.mark.parametrize(
    ("token", "call", "reason"),
    [
        ("look", ("start_search", SEARCH), "'gateway.search_token'"),
        ("look", ("stop", {}), "may only look"),
        ("move", ("start_search", {"objects": ["sofa"]}), "'max_distance_m' is missing"),
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


def test_without_a_token_there_is_no_agent(worker: GatewayWorker) -> None:
    with pytest.raises(Exception, match="TaskGroup"):  # a group: 3.10 has no name for it
        played(worker, "wrong", ("list_objects", {}))


def test_the_example_of_the_documents_runs(
    worker: GatewayWorker, capsys: pytest.CaptureFixture[str]
) -> None:
    page = (ROOT / "docs" / "agents.md").read_text(encoding="utf-8")
    example = page.split("```python\n")[1].split("```")[0]
    example = example.replace("127.0.0.1:8080", f"127.0.0.1:{worker.port}")
    exec(compile(example.replace("<token>", "look"), "agents.md", "exec"), {})
    assert "look like 'sofa'" in capsys.readouterr().out
