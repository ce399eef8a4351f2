"""The application: its document, pages, methods, headers, and answers without services."""

from __future__ import annotations

import json
import re
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pydantic import SecretStr
from starlette.testclient import TestClient

from onemap_gateway.config import GatewayConfig
from onemap_gateway.http.context import GatewayContext, Paces
from onemap_gateway.http.problems import PROBLEM_TYPES
from onemap_gateway.http.routes.pages import STATIC
from onemap_gateway.http.schemas import EXAMPLE_PNG
from onemap_shared import keys
from tests.gateway import fakes
from tests.memory_bus import MemoryRouter

BODIES: dict[str, object] = {
    "/v1/queries": {"text": "sofa"},
    "/v1/searches": {"object": "sofa"},
    "/v1/map.png": {"image": EXAMPLE_PNG},
    "/v1/places/{name}": {"inside_m": [1, 2]},
    "/mcp": {"jsonrpc": "2.0", "id": 1, "method": "tools/list"},
}
PARAMETERS = {"/v1/words": {"text": "lamp in the hall"}}
WITHOUT_SERVICES = {"/v1/robots", "/healthz", "/v1/status", "/metrics", "/mcp"}


def operations(client: TestClient) -> list[tuple[str, str, dict[str, Any]]]:
    paths = client.get("/openapi.json").json()["paths"]
    return [
        (method.upper(), path, operation)
        for path, methods in paths.items()
        for method, operation in methods.items()
    ]


SILENT: tuple[keys.Procedure[Any, Any], ...] = (
    keys.MAP_SIMILARITY,
    keys.MAP_SEARCH_VIEW,
    keys.MAP_CLEAR,
    keys.SEARCH_START,
    keys.SEARCH_CANCEL,
    keys.SEARCH_GET,
)


@pytest.mark.parametrize("silent", [(), SILENT], ids=["absent", "silent"])
def test_no_route_hangs_when_no_service_answers(
    router: MemoryRouter, silent: tuple[keys.Procedure[Any, Any], ...]
) -> None:
    release, bus = threading.Event(), router.bus()
    for procedure in silent:
        bus.serve(procedure, lambda _request: release.wait())
    with fakes.client_on(router, paces=Paces(call_timeout_s=0.1)) as client:
        for method, path, _ in operations(client):
            address = path.format(search_id="s1", name="flat", object_id="3f9a12c4")
            answer = client.request(
                method, address, json=BODIES.get(path), params=PARAMETERS.get(path)
            )
            if path in WITHOUT_SERVICES:
                assert answer.status_code == 200, path
                continue
            assert answer.status_code == 503, path
            assert answer.headers["Content-Type"] == "application/problem+json"
            assert answer.json()["service"] in ("robot", "mapper", "planner")
    release.set()
    bus.close()


def test_no_reply_holds_what_json_has_not(
    router: MemoryRouter, mapper: fakes.FakeMapper, planner: fakes.FakePlanner
) -> None:
    """NaN in what the services say: Python would write it, and no browser reads it."""
    nan = float("nan")
    planner.status = replace(fakes.search(), path_length_m=nan)
    mapper.objects = [replace(fakes.kept_object(), last_seen_ns=1)]
    robot = router.bus("simulator")
    with fakes.gateway_on(router) as gateway:
        client = fakes.client_of(gateway)
        robot.publish(keys.ROBOT_ODOMETRY).put(fakes.odometry(1, 2))
        robot.publish(keys.MAP_REVISION).put(replace(fakes.revision(3), update_ms=nan))
        robot.publish(keys.SEARCH_STATE).put(planner.status)
        beat = replace(fakes.heartbeat("mapper"), metrics={"fps": nan})
        robot.publish(keys.heartbeat("mapper")).put(beat)
        assert fakes.state_reached(
            gateway.cache, lambda s: bool(s.odometry and s.search and s.revision)
        )
        assert fakes.state_reached(gateway.cache, lambda state: bool(state.heartbeats))
        for method, path, _ in operations(client):
            address = path.format(search_id="s1", name="flat", object_id="3f9a12c4")
            if method == "GET" and "events" not in path:
                answer = client.get(address)
                assert answer.status_code < 500 or path in {"/readyz", "/v1/camera.jpg"}, path
                if "json" in answer.headers["Content-Type"]:
                    json.loads(answer.text, parse_constant=fakes.refuse_constant)
        with client.websocket_connect("ws://localhost:8080/v1/live") as socket:
            json.loads(socket.receive_text(), parse_constant=fakes.refuse_constant)


def test_the_document_is_whole(client: TestClient) -> None:
    for method, path, operation in operations(client):
        for part in ("summary", "description", "tags"):
            assert operation[part], (method, path)
        if "requestBody" in operation:
            assert {"400", "413", "415", "422"} <= set(operation["responses"]), path
    document = client.get("/openapi.json").json()
    schemas = document["components"]["schemas"]
    assert set(re.findall(r'"#/components/schemas/(\w+)"', json.dumps(document))) <= set(schemas)
    assert set(document["x-problems"]) == set(PROBLEM_TYPES)
    for path, name in (("/v1/queries", "QueryRequest"), ("/v1/searches", "SearchStart")):
        assert client.post(path, json=schemas[name]["examples"][0]).is_success
        wanted = ["'{}'".format(*each["required"]) for each in schemas[name]["oneOf"]]
        refused = client.post(path, json={}).json()["detail"]
        assert refused.startswith("Give exactly one of")
        assert re.findall(r"'\w+'", refused) == wanted
    for reply in ("QueryResult", "SearchSnapshot", "StoredMap", "MapObject"):
        assert schemas[reply]["examples"], reply


TOKEN = {"Authorization": "Bearer hunter2"}
HOSTILE: dict[str, dict[str, Any]] = {
    "no token": {},
    "a wrong token": {"headers": {"Authorization": "Bearer hunter"}},
    "a rebound host": {"headers": {**TOKEN, "Host": "evil.example"}},
    "another site": {"headers": {**TOKEN, "Origin": "http://evil.example"}},
    "no service": {"headers": TOKEN},
    "a large body": {"headers": TOKEN, "content": b"x" * 70_000},
    "a form": {"headers": {**TOKEN, "Content-Type": "text/plain"}, "content": b"a=b"},
    "no JSON": {"headers": {**TOKEN, "Content-Type": "application/json"}, "content": b"[" * 5000},
    "no UTF-8": {
        "headers": {**TOKEN, "Content-Type": "application/json"},
        "content": b'{"a": "\xff"}',
    },
    "a list": {"headers": TOKEN, "json": [1]},
    "a string": {"headers": TOKEN, "json": "sofa"},
    "a wrong body": {"headers": TOKEN, "json": {"text": 5, "objects": [[]], "name": "../x"}},
    "a wrong query": {"headers": TOKEN, "params": {"text": "", "scale": -1, "detections": "?"}},
}


NO_OBJECT = {  # status and words where a route takes a body
    "no JSON": (400, "body cannot be read as JSON"),
    "no UTF-8": (400, "write it in UTF-8"),
    "a list": (422, "body must be one JSON object"),
    "a string": (422, "body must be one JSON object"),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_every_status_is_documented(router: MemoryRouter, case: str) -> None:
    config = GatewayConfig(token=SecretStr("hunter2"))
    with fakes.client_on(router, config) as client:
        for method, path, operation in operations(client):
            if case in NO_OBJECT and "requestBody" not in operation:
                continue
            address = path.format(search_id="a%FFb", name="%2e%2e", object_id="%00")
            answer = client.request(method, address, **HOSTILE[case])
            assert str(answer.status_code) in operation["responses"], (method, path)
            assert answer.status_code != 500
            if case in NO_OBJECT:
                status, words = NO_OBJECT[case]
                assert answer.status_code == status, path
                assert words in answer.json()["detail"], path


def test_an_unknown_address_is_a_problem(client: TestClient) -> None:
    for path in ("/nix", "/v1/", "/v1/queries/", "/static/nix.js", "/static/../app.py"):
        answer = client.get(path)
        assert answer.status_code == 404, path
        assert answer.headers["Content-Type"] == "application/problem+json"
        assert "/docs" in answer.json()["detail"]


@pytest.mark.parametrize("file", sorted(STATIC.iterdir()), ids=lambda path: path.name)
def test_static_files_load_nothing_from_elsewhere_and_what_they_refer_to_exists(
    client: TestClient, file: Path
) -> None:
    assert client.get(f"/static/{file.name}").status_code == 200
    text = file.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
    assert not re.search(r"https?://|//[a-z]+\.[a-z]|@import", text)
    for path in re.findall(r'(?:src|href)="(/[^"#]*)"', text):
        assert client.get(path).status_code == 200, path
    for name in re.findall(r'from "\./([^"]+)"', text):
        assert (STATIC / name).is_file()
    if file.suffix == ".html":  # the content security policy would run nothing that is inline
        assert " style=" not in text
        assert not re.search(r"<script(?![^>]*src=)|\son\w+=", text)


def test_every_element_that_scripts_ask_for_is_on_the_page() -> None:
    for script in STATIC.glob("*.js"):
        html = "docs.html" if script.name == "docs.js" else "index.html"
        page = (STATIC / html).read_text(encoding="utf-8")
        text = script.read_text(encoding="utf-8")
        for name in re.findall(r'(?:by|getElementById)\("([^"]+)"\)', text):
            assert f'id="{name}"' in page, (script.name, name)


CHANGING = {"content-length", "x-onemap-age"}  # from one request to the next
EVENTS = "/v1/searches/{search_id}/events"


def test_every_answer_forbids_framing_sniffing_and_keeping(client: TestClient) -> None:
    swagger_ui = "/static/swagger-ui/swagger-ui-bundle.js"
    for path in ("/", "/docs", "/favicon.ico", swagger_ui, "/healthz", "/nothing", "/v1/map.png"):
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
    with fakes.gateway_on(router) as gateway:
        answer = fakes.client_of(gateway).get("/readyz")
    assert answer.status_code == 500
    assert answer.json()["status"] == 500
    assert "a bug" not in answer.text
    assert "a bug" in caplog.text
