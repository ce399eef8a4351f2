"""Requests of the client, and errors for bad replies and timeouts."""

from __future__ import annotations

import json

import httpx
import pytest

from onemap_tools.client import MAX_FAILED_POLLS, GatewayClient, SearchHandle
from onemap_tools.errors import EXIT_FAILED, EXIT_USAGE_ERROR, CliError


def gateway_client(handler: httpx.MockTransport) -> GatewayClient:
    return GatewayClient("http://robot:8080", token="secret", transport=handler)


def fake_gateway(status: int, body: object) -> httpx.MockTransport:
    return httpx.MockTransport(lambda _: httpx.Response(status, json=body))


def failing(problem: type[httpx.HTTPError]) -> httpx.MockTransport:
    def handle(request: httpx.Request) -> httpx.Response:
        raise problem("no")

    return httpx.MockTransport(handle)


def test_requests_go_where_the_gateway_expects_them() -> None:
    seen: list[tuple[str, str, object]] = []

    def handle(request: httpx.Request) -> httpx.Response:
        assert request.headers["Authorization"] == "Bearer secret"
        body = json.loads(request.content) if request.content else None
        seen.append((request.method, request.url.path, body))
        return httpx.Response(200, json={"ok": True})

    with gateway_client(httpx.MockTransport(handle)) as gateway:
        gateway.query("red sofa", 3)
        gateway.start_search(("sofa", "bed"))
        gateway.search("s1")
        gateway.cancel("s1")
        gateway.status()
        gateway.map_info()
        gateway.map_archive()
        gateway.map_save("flat")
        gateway.map_load("flat")
        gateway.map_clear()
    assert seen == [
        ("POST", "/v1/queries", {"text": "red sofa", "max_regions": 3}),
        ("POST", "/v1/searches", {"objects": ["sofa", "bed"]}),
        ("GET", "/v1/searches/s1", None),
        ("DELETE", "/v1/searches/s1", None),
        ("GET", "/v1/status", None),
        ("GET", "/v1/map", None),
        ("GET", "/v1/map.npz", None),
        ("POST", "/v1/map/save", {"name": "flat"}),
        ("POST", "/v1/map/load", {"name": "flat"}),
        ("POST", "/v1/map/clear", None),
    ]


def test_a_problem_document_is_reported_by_its_detail() -> None:
    detail = "The mapper is not running: start it with 'onemap mapper', or see 'onemap status'."
    with pytest.raises(CliError) as error:
        gateway_client(fake_gateway(503, {"status": 503, "detail": detail})).query("sofa", 5)
    assert str(error.value) == detail
    assert error.value.exit_code == EXIT_FAILED


def test_an_error_without_detail_is_reported_by_its_status() -> None:
    with pytest.raises(CliError, match="answers 502 Bad Gateway"):
        gateway_client(fake_gateway(502, ["?"])).status()


def test_without_a_server_the_remedy_is_named() -> None:
    with pytest.raises(CliError, match=r"No gateway at http://robot:8080: start .*onemap up"):
        gateway_client(failing(httpx.ConnectError)).status()


def test_a_timeout_is_reported_with_its_length() -> None:
    with pytest.raises(CliError, match="did not answer within 5 s"):
        gateway_client(failing(httpx.ReadTimeout)).status()


def test_another_program_on_the_port_is_recognised() -> None:
    page = httpx.MockTransport(lambda _: httpx.Response(200, html="<html>hello</html>"))
    with pytest.raises(CliError, match="another program"):
        gateway_client(page).status()


@pytest.mark.parametrize("url", ["robot:8080", "ftp://robot", "http://[::1"])
def test_a_wrong_url_is_a_usage_error(url: str) -> None:
    with pytest.raises(CliError) as error:
        GatewayClient(url).status()
    assert error.value.exit_code == EXIT_USAGE_ERROR


def test_the_missing_stage_is_the_detail_of_readyz() -> None:
    assert gateway_client(fake_gateway(200, {"status": "ok"})).missing_stage() == ""
    missing = gateway_client(
        fake_gateway(503, {"detail": "The mapper is not running."})
    ).missing_stage()
    assert missing == "The mapper is not running."
    assert "gateway" in gateway_client(failing(httpx.ConnectError)).missing_stage()


def test_a_search_handle_tolerates_an_absent_gateway_for_a_while() -> None:
    detail = "The planner is not running."
    handle = SearchHandle(
        gateway_client(fake_gateway(503, {"detail": detail})), {"id": "s1", "state": "exploring"}
    )
    for _ in range(MAX_FAILED_POLLS):
        assert handle.poll() == detail
    with pytest.raises(CliError, match="planner"):
        handle.poll()
    assert handle.active


def test_a_search_handle_updates_its_report() -> None:
    found = {"id": "s1", "state": "found"}
    handle = SearchHandle(
        gateway_client(fake_gateway(200, found)), {"id": "s1", "state": "exploring"}
    )
    assert handle.active
    assert handle.poll() == ""
    assert handle.report == found
    assert not handle.active
