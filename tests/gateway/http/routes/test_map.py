"""/v1/map: image, arrays, numbers."""

from __future__ import annotations

import io
from base64 import b64encode

import numpy as np
import pytest
from starlette.testclient import TestClient

from onemap_gateway.present.palette import DARK, LIGHT
from onemap_shared.memory_bus import MemoryRouter
from tests.gateway.fakes import FakeMapper, client_of, client_on, decoded, gateway_on
from tests.shared.samples import PNG


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

    assert at(1.0, 0.5) == DARK.free
    assert at(2.05, 0.5) == DARK.occupied


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


def test_the_image_may_show_the_similarity_to_an_image(router: MemoryRouter) -> None:
    mapper = FakeMapper(router)
    with client_on(router) as client:
        text = client.get("/v1/map.png?marks=false&scale=4&text=sofa")
        body = {"image": b64encode(PNG).decode()}
        image = client.post("/v1/map.png?marks=false&scale=4", json=body)
    assert mapper.images == [PNG]
    assert image.headers["Content-Type"] == "image/png"
    assert image.headers["X-OneMap-Bounds"] == text.headers["X-OneMap-Bounds"]
    np.testing.assert_array_equal(decoded(image.content), decoded(text.content))
    mapper.bus.close()


@pytest.mark.parametrize(
    ("body", "query", "reason"),
    [
        ({}, "", "'image' is missing"),
        ({"image": "R0lGODlh"}, "", "no PNG and no JPEG"),
        ({"image": b64encode(PNG).decode(), "text": "sofa"}, "", "'text' is no field"),
        ({"image": b64encode(PNG).decode()}, "?scale=0", "scale"),
    ],
)
def test_a_similarity_to_what_is_no_image_is_refused(
    client: TestClient, body: dict[str, str], query: str, reason: str
) -> None:
    answer = client.post(f"/v1/map.png{query}", json=body)
    assert answer.status_code == 422
    assert reason in answer.json()["detail"]


def test_the_image_may_have_the_colours_of_a_light_page(client: TestClient) -> None:
    image = decoded(client.get("/v1/map.png?marks=false&theme=light").content)
    assert (image == LIGHT.free).all(axis=2).any()
    assert not (image == DARK.free).all(axis=2).any()


@pytest.mark.parametrize(
    "query",
    [
        "scale=0",
        "scale=33",
        "scale=x",
        "text=",
        "text=%20",
        "text=flurb",
        "marks=perhaps",
        "theme=pink",
    ],
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


def test_the_map_is_cleared(client: TestClient) -> None:
    assert client.post("/v1/map/clear").json()["cells_observed"] == 315


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "/v1/map"),
        ("GET", "/v1/map.png"),
        ("GET", "/v1/map.npz"),
        ("POST", "/v1/map/clear"),
    ],
)
def test_without_a_mapper_it_is_named(router: MemoryRouter, method: str, path: str) -> None:
    with gateway_on(router) as gateway:
        answer = client_of(gateway).request(method, path)
    assert answer.status_code == 503
    assert answer.json()["service"] == "mapper"
