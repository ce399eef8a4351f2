"""/v1/map: image, arrays, numbers, files."""

from __future__ import annotations

import io

import numpy as np
import pytest
from starlette.testclient import TestClient

from onemap_gateway.present.render import FREE, OCCUPIED
from onemap_shared.memory_bus import MemoryRouter
from tests.gateway.fakes import FakeMapper, client_of, decoded, gateway_on


def test_the_image_has_its_bounds_and_its_colours(client: TestClient) -> None:
    answer = client.get("/v1/map.png?marks=false&scale=4")
    assert answer.headers["Content-Type"] == "image/png"
    assert answer.headers["X-OneMap-Revision"] == "7"
    x_min, y_min, x_max, y_max = map(float, answer.headers["X-OneMap-Bounds"].split(","))
    image = decoded(answer.content)
    assert image.shape[1] == round((x_max - x_min) / 0.1) * 4
    assert image.shape[0] == round((y_max - y_min) / 0.1) * 4

    def at(x_m: float, y_m: float) -> tuple[int, ...]:
        return tuple(image[int((y_max - y_m) * 40), int((x_m - x_min) * 40)].tolist())

    assert at(1.0, 0.5) == FREE
    assert at(2.05, 0.5) == OCCUPIED


def test_the_image_may_show_a_heatmap(client: TestClient) -> None:
    plain = client.get("/v1/map.png?marks=false&scale=10")
    heated = decoded(client.get("/v1/map.png?marks=false&scale=10&text=sofa").content)
    x_min, _, _, y_max = map(float, plain.headers["X-OneMap-Bounds"].split(","))
    rows, columns = np.nonzero((heated != decoded(plain.content)).any(axis=2))
    # the match covers x 0.2 to 0.5 m and y 1.0 to 1.3 m; interpolation adds half a cell, 0.05 m
    np.testing.assert_allclose(x_min + columns.min() / 100, 0.2, atol=0.06)
    np.testing.assert_allclose(x_min + columns.max() / 100, 0.5, atol=0.06)
    np.testing.assert_allclose(y_max - rows.max() / 100, 1.0, atol=0.06)
    np.testing.assert_allclose(y_max - rows.min() / 100, 1.3, atol=0.06)


@pytest.mark.parametrize(
    "query", ["scale=0", "scale=33", "scale=x", "text=", "text=%20", "text=flurb", "marks=perhaps"]
)
def test_an_image_that_cannot_be_is_refused(client: TestClient, query: str) -> None:
    answer = client.get(f"/v1/map.png?{query}")
    assert answer.status_code == 422
    assert answer.json()["detail"]


def test_the_arrays(client: TestClient) -> None:
    answer = client.get("/v1/map.npz?text=sofa")
    assert "map.npz" in answer.headers["Content-Disposition"]
    with np.load(io.BytesIO(answer.content), allow_pickle=False) as archive:
        assert archive["occupancy"].shape == archive["similarity"].shape == (40, 30)


def test_the_numbers(client: TestClient) -> None:
    info = client.get("/v1/map").json()
    assert info["revision"] == 7
    assert info["bounds_m"] == pytest.approx([-1.0, -0.5, 3.0, 2.5])


def test_a_map_is_saved_loaded_and_cleared(client: TestClient, mapper: FakeMapper) -> None:
    saved = client.post("/v1/map/save", json={"name": "flat"})
    assert saved.status_code == 200
    assert saved.json()["path"] == "maps/flat"
    assert mapper.saved == ["flat"]
    assert client.post("/v1/map/load", json={"name": "flat"}).json()["cells_observed"] == 315
    assert client.post("/v1/map/clear").status_code == 200


def test_a_map_that_is_not_there_cannot_be_loaded(client: TestClient) -> None:
    answer = client.post("/v1/map/load", json={"name": "nix"})
    assert answer.status_code == 404
    assert answer.json()["type"].endswith("unknown_map")
    assert "nix" in answer.json()["detail"]


@pytest.mark.parametrize("name", ["", "../a", "a/b", "/etc/passwd", ".a", "x" * 65, 5, "a\x00"])
@pytest.mark.parametrize("verb", ["save", "load"])
def test_a_name_that_is_a_path_is_refused(client: TestClient, name: object, verb: str) -> None:
    assert client.post(f"/v1/map/{verb}", json={"name": name}).status_code == 422


def test_a_refused_name_comes_back_with_the_allowed_letters(client: TestClient) -> None:
    detail = client.post("/v1/map/save", json={"name": "Küche 1"}).json()["detail"]
    assert "letters (A-Z, a-z), digits, '.', '_' and '-'" in detail
    names = client.get("/openapi.json").json()["components"]["schemas"]["MapName"]["properties"]
    assert names["name"]["pattern"] == "^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$"


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "/v1/map"),
        ("GET", "/v1/map.png"),
        ("GET", "/v1/map.npz"),
        ("POST", "/v1/map/save"),
        ("POST", "/v1/map/load"),
        ("POST", "/v1/map/clear"),
    ],
)
def test_without_a_mapper_it_is_named(router: MemoryRouter, method: str, path: str) -> None:
    with gateway_on(router) as gateway:
        body = {"name": "flat"} if method == "POST" else None
        answer = client_of(gateway).request(method, path, json=body)
    assert answer.status_code == 503
    assert answer.json()["service"] == "mapper"
