"""/v1/map and /v1/camera.jpg."""

from __future__ import annotations

import io

import cv2
import numpy as np
import pytest
from starlette.testclient import TestClient

from onemap_gateway.present.render import FREE, OCCUPIED
from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from tests.gateway import fakes
from tests.gateway.fakes import FakeMapper, client_of, gateway_on, state_reached


def decoded(data: bytes) -> np.ndarray:
    """The RGB image of a PNG or JPEG."""
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB))


def test_the_picture_has_its_bounds_and_its_colours(client: TestClient) -> None:
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


def test_the_picture_may_glow(client: TestClient) -> None:
    plain = decoded(client.get("/v1/map.png?marks=false").content)
    warm = decoded(client.get("/v1/map.png?marks=false&text=sofa").content)
    assert plain.shape == warm.shape
    assert (plain != warm).any()


@pytest.mark.parametrize(
    "query", ["scale=0", "scale=33", "scale=x", "text=", "text=%20", "text=flurb", "marks=perhaps"]
)
def test_a_picture_that_cannot_be_is_refused(client: TestClient, query: str) -> None:
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


def test_a_refused_name_is_told_which_letters_are_allowed(client: TestClient) -> None:
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


def test_the_camera_shows_the_newest_image_with_its_detections(router: MemoryRouter) -> None:
    robot = router.bus("simulator")
    with gateway_on(router) as gateway:
        robot.publish(keys.ROBOT_RGBD).put(fakes.rgbd(5))
        robot.publish(keys.DETECTIONS).put(fakes.detections("sofa", sequence=5))
        assert state_reached(gateway.cache, lambda s: bool(s.frame and s.detections))
        client = client_of(gateway)
        drawn = client.get("/v1/camera.jpg")
        plain = client.get("/v1/camera.jpg?detections=false")
    assert drawn.headers["X-OneMap-Sequence"] == "5"
    assert decoded(plain.content).shape == (24, 32, 3)
    assert drawn.content != plain.content


def test_without_a_camera_the_robot_is_missing(client: TestClient) -> None:
    answer = client.get("/v1/camera.jpg")
    assert answer.status_code == 503
    assert answer.json()["service"] == "robot"
