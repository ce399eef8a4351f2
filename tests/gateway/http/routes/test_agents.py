"""POST /mcp: roles, and an SDK that is not there."""

from __future__ import annotations

import json
import sys

import pytest
from pydantic import SecretStr
from starlette.testclient import TestClient

from onemap_gateway.config import GatewayConfig
from onemap_shared.memory_bus import MemoryRouter
from tests.gateway.fakes import client_on


def test_without_the_sdk_one_sentence_says_what_to_install(
    client: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "onemap_gateway.http.mcp_server", raising=False)
    monkeypatch.setitem(sys.modules, "mcp", None)
    answer = client.post("/mcp", json=REQUEST)
    assert answer.status_code == 501
    assert "'pip install onemap[mcp]'" in answer.json()["detail"]


def test_there_is_no_stream_to_listen_to(client: TestClient) -> None:
    for method in ("GET", "DELETE"):
        answer = client.request(method, "/mcp")
        assert (answer.status_code, answer.headers["Allow"]) == (405, "POST, OPTIONS")


@pytest.mark.parametrize(("headers", "status"), [({}, 401), ({"Authorization": "Bearer x"}, 401)])
def test_an_agent_needs_a_token(router: MemoryRouter, headers: dict[str, str], status: int) -> None:
    with client_on(router, GatewayConfig(token=SecretStr("secret"))) as client:
        assert client.post("/mcp", json={}, headers=headers).status_code == status


REQUEST = {"jsonrpc": "2.0", "id": 1, "method": "tools/list"}


@pytest.mark.parametrize(
    ("body", "fault"),
    [
        (b"", "not valid JSON"),
        (b"x", "not valid JSON"),
        (b"\xff\xfe", "not valid JSON"),
        (b"[" * 300, "not valid JSON"),
        (b"3", "holds no JSON object"),
        (json.dumps([REQUEST]).encode(), "or several"),
        (b"{}", "'jsonrpc' must be"),
        (b'{"jsonrpc": "2.0", "id": 1}', "'method' must"),
        (b'{"jsonrpc": "2.0", "id": 1, "result": {}}', "'method' must"),
        (b'{"jsonrpc": "2.0", "id": 1, "method": 7}', "'method' must"),
        (b'{"jsonrpc": "2.0", "id": null, "method": "tools/list"}', "'id' must"),
        (b'{"jsonrpc": "2.0", "id": true, "method": "tools/list"}', "'id' must"),
        (b'{"jsonrpc": "2.0", "id": 1, "method": "tools/list", "params": 3}', "'params' must"),
    ],
)
def test_what_is_no_message_is_refused_in_a_sentence(
    client: TestClient, body: bytes, fault: str
) -> None:
    headers = {"Accept": "application/json", "Content-Type": "application/json"}
    answer = client.post("/mcp", content=body, headers=headers)
    assert answer.status_code == 400
    assert answer.headers["content-type"] == "application/problem+json"
    detail = answer.json()["detail"]
    assert fault in detail
    assert "send one JSON-RPC request to /mcp" in detail
    assert "pydantic" not in detail


def test_a_message_is_read_to_its_end(client: TestClient) -> None:
    pytest.importorskip("mcp", reason="the extra 'mcp' is not installed")
    answer = client.post("/mcp", json=REQUEST, headers={"Accept": "application/json"})
    assert answer.status_code == 200
    assert answer.json()["result"]["tools"]


def test_a_body_of_no_json_type_is_refused(client: TestClient) -> None:
    for nothing in (client.post("/mcp", content=b"x"), client.post("/mcp")):
        assert nothing.status_code == 415
        assert nothing.headers["content-type"] == "application/problem+json"
