"""POST /mcp: roles, and an SDK that is not there."""

from __future__ import annotations

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
    monkeypatch.delitem(sys.modules, "onemap_gateway.http.agents.server", raising=False)
    monkeypatch.setitem(sys.modules, "mcp", None)
    answer = client.post("/mcp", json={})
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


def test_what_is_no_message_is_refused(client: TestClient) -> None:
    pytest.importorskip("mcp", reason="the extra 'mcp' is not installed")
    answer = client.post("/mcp", json={}, headers={"Accept": "application/json"})
    assert answer.status_code == 400
    for nothing in (client.post("/mcp", content=b"x"), client.post("/mcp")):
        assert nothing.status_code == 415
        assert nothing.headers["content-type"] == "application/problem+json"
