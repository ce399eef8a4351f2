"""Headers and counts of every response, and a response when a route fails."""

from __future__ import annotations

import pytest
from starlette.testclient import TestClient

from onemap_gateway.http.context import GatewayContext
from onemap_shared.memory_bus import MemoryRouter
from tests.gateway.fakes import client_of, gateway_on


def test_every_answer_forbids_framing_sniffing_and_keeping(client: TestClient) -> None:
    swagger_ui = "/static/swagger-ui/swagger-ui-bundle.js"
    for path in ("/", "/docs", swagger_ui, "/healthz", "/nothing", "/v1/map.png"):
        headers = client.get(path).headers
        assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["Cache-Control"] in ("no-store", "no-cache")


def test_a_failing_route_is_a_problem_and_is_logged(
    router: MemoryRouter, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(_gateway: GatewayContext) -> None:
        raise RuntimeError("a bug")

    monkeypatch.setattr(GatewayContext, "fault", fail)
    with gateway_on(router) as gateway:
        answer = client_of(gateway).get("/readyz")
    assert answer.status_code == 500
    assert answer.json()["status"] == 500
    assert "a bug" not in answer.text
    assert "a bug" in caplog.text
