"""/v1/maps: saved maps, and the older addresses that save and load."""

from __future__ import annotations

import pytest
from starlette.testclient import TestClient

from onemap_shared.memory_bus import MemoryRouter
from tests.gateway.fakes import FakeMapper, client_of, gateway_on


def test_a_map_is_saved_listed_loaded_and_deleted(client: TestClient, mapper: FakeMapper) -> None:
    saved = client.put("/v1/maps/flat")
    assert saved.status_code == 201
    assert saved.headers["Location"] == "/v1/maps/flat"
    assert saved.json()["path"] == "maps/flat"
    again = client.put("/v1/maps/flat")
    assert again.status_code == 200
    assert "Location" not in again.headers
    report = client.get(saved.headers["Location"]).json()
    assert client.get("/v1/maps").json() == {"maps": [report], "left_out": 4}
    assert client.post("/v1/maps/flat/load").json()["cells_observed"] == 315
    assert client.delete("/v1/maps/flat").json() == report
    assert mapper.saved == []
    assert client.get("/v1/maps").json()["maps"] == []


def test_a_saved_map_says_what_it_is_and_when_it_was_written(client: TestClient) -> None:
    client.put("/v1/maps/flat")
    assert client.get("/v1/maps/flat").json() == {
        "name": "flat",
        "file_bytes": 2048,
        "saved_at": "2026-01-01T00:00:00.000Z",
        "saved_ns": "1767225600000000000",
        "encoder_id": "fake-1",
        "text_space": "fake",
        "cell_size_m": 0.1,
        "cells_observed": 315,
        "frames_fused": 7,
        "problem": "",
    }


@pytest.mark.parametrize(
    ("method", "path"),
    [("GET", "/v1/maps/nix"), ("DELETE", "/v1/maps/nix"), ("POST", "/v1/maps/nix/load")],
)
def test_a_map_that_is_not_there_is_not_found(client: TestClient, method: str, path: str) -> None:
    answer = client.request(method, path)
    assert answer.status_code == 404
    assert answer.json()["type"].endswith("unknown_map")
    assert "nix" in answer.json()["detail"]


@pytest.mark.parametrize("name", ["%2e%2e", ".a", "-a", "a%20b", "x" * 65, "a%00", "K%C3%BCche"])
def test_a_name_that_is_no_file_name_is_refused(
    client: TestClient, mapper: FakeMapper, name: str
) -> None:
    for method, suffix in (("GET", ""), ("PUT", ""), ("DELETE", ""), ("POST", "/load")):
        answer = client.request(method, f"/v1/maps/{name}{suffix}")
        assert answer.status_code == 422, method
        assert "letters (A-Z, a-z), digits, '.', '_' and '-'" in answer.json()["detail"]
    assert mapper.saved == []


@pytest.mark.parametrize("name", ["..%2Fa", "%2Fetc%2Fpasswd", "a%2Fb"])
def test_a_name_in_another_folder_is_not_found(client: TestClient, name: str) -> None:
    for method in ("GET", "PUT", "DELETE"):
        assert client.request(method, f"/v1/maps/{name}").status_code == 404


def test_the_older_addresses_still_save_and_load(client: TestClient, mapper: FakeMapper) -> None:
    saved = client.post("/v1/map/save", json={"name": "flat"})
    assert saved.status_code == 200
    assert mapper.saved == ["flat"]
    assert client.post("/v1/map/load", json={"name": "flat"}).json() == saved.json()
    assert client.post("/v1/map/load", json={"name": "nix"}).status_code == 404


def test_the_older_addresses_are_marked_and_name_their_successors(client: TestClient) -> None:
    paths = client.get("/openapi.json").json()["paths"]
    deprecated = {
        path: operation["description"].split("`")[1]
        for path, methods in paths.items()
        for operation in methods.values()
        if operation.get("deprecated")
    }
    assert deprecated == {
        "/v1/map/save": "PUT /v1/maps/{name}",
        "/v1/map/load": "POST /v1/maps/{name}/load",
    }


@pytest.mark.parametrize("name", ["", "../a", "a/b", "/etc/passwd", ".a", "x" * 65, 5, "a\x00"])
@pytest.mark.parametrize("verb", ["save", "load"])
def test_a_name_that_is_a_path_is_refused(client: TestClient, name: object, verb: str) -> None:
    assert client.post(f"/v1/map/{verb}", json={"name": name}).status_code == 422


def test_a_refused_name_comes_back_with_the_allowed_letters(client: TestClient) -> None:
    detail = client.post("/v1/map/save", json={"name": "Küche 1"}).json()["detail"]
    assert "letters (A-Z, a-z), digits, '.', '_' and '-'" in detail
    document = client.get("/openapi.json").json()
    names = document["components"]["schemas"]["MapName"]["properties"]
    (parameter,) = document["paths"]["/v1/maps/{name}"]["get"]["parameters"]
    assert parameter["schema"]["pattern"] == names["name"]["pattern"]
    assert names["name"]["pattern"] == "^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$"


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "/v1/maps"),
        ("GET", "/v1/maps/flat"),
        ("PUT", "/v1/maps/flat"),
        ("DELETE", "/v1/maps/flat"),
        ("POST", "/v1/maps/flat/load"),
        ("POST", "/v1/map/save"),
        ("POST", "/v1/map/load"),
    ],
)
def test_without_a_mapper_it_is_named(router: MemoryRouter, method: str, path: str) -> None:
    with gateway_on(router) as gateway:
        body = {"name": "flat"} if path.startswith("/v1/map/") else None
        answer = client_of(gateway).request(method, path, json=body)
    assert answer.status_code == 503
    assert answer.json()["service"] == "mapper"


def test_a_saved_map_is_merged_where_the_body_says(client: TestClient, mapper: FakeMapper) -> None:
    client.put("/v1/maps/flat")
    assert client.post("/v1/maps/flat/merge").json()["cells_observed"] == 315
    body = {"x_m": 1.5, "y_m": -2.0, "yaw_rad": 0.5}
    assert client.post("/v1/maps/flat/merge", json=body).status_code == 200
    assert [(m.name, m.x_m, m.y_m, m.yaw_rad) for m in mapper.merged] == [
        ("flat", 0.0, 0.0, 0.0),
        ("flat", 1.5, -2.0, 0.5),
    ]
    assert client.post("/v1/maps/other/merge").status_code == 404
    assert client.post("/v1/maps/flat/merge", json={"x_m": 1e9}).status_code == 422
    assert client.post("/v1/maps/flat/merge", json={"z_m": 1}).status_code == 422
