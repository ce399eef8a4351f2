"""The map, saved maps, found objects and the camera over HTTP."""

from __future__ import annotations

import io
from base64 import b64encode
from dataclasses import replace

import numpy as np
import pytest
from starlette.testclient import TestClient

from onemap_gateway.present.palette import DARK
from onemap_gateway.present.render import BOX
from onemap_shared import keys
from tests.gateway import fakes
from tests.memory_bus import MemoryRouter
from tests.shared.samples import PNG


def test_the_image_has_its_bounds_and_its_colours(client: TestClient) -> None:
    answer = client.get("/v1/map.png?marks=false&scale=4")
    assert answer.headers["Content-Type"] == "image/png"
    assert answer.headers["X-OneMap-Revision"] == "7"
    x_min, y_min, x_max, y_max = map(float, answer.headers["X-OneMap-Bounds"].split(","))
    image = fakes.decoded(answer.content)
    assert image.shape[1] == round((x_max - x_min) / 0.1) * 4
    assert image.shape[0] == round((y_max - y_min) / 0.1) * 4

    def at(x_m: float, y_m: float) -> tuple[int, ...]:
        return tuple(image[int((y_max - y_m) * 40), int((x_m - x_min) * 40)].tolist())

    assert at(1.0, 0.5) == DARK.free
    assert at(2.05, 0.5) == DARK.occupied
    assert at(2.05, 1.5) == DARK.wall


def test_the_heights_lie_where_the_image_shows_the_obstacles(client: TestClient) -> None:
    image = client.get("/v1/map.png?marks=false&scale=1")
    answer = client.get("/v1/map/heights.png")
    assert answer.headers["X-OneMap-Bounds"] == image.headers["X-OneMap-Bounds"]
    heights = fakes.decoded(answer.content)[..., 0]
    walls = (fakes.decoded(image.content) == DARK.wall).all(axis=2)
    assert (heights[walls] == 22).all()
    assert np.bincount(heights.ravel()).nonzero()[0].tolist() == [0, 8, 22]


def test_the_image_may_show_a_heatmap(client: TestClient) -> None:
    plain = client.get("/v1/map.png?marks=false&scale=10")
    heated = fakes.decoded(client.get("/v1/map.png?marks=false&scale=10&text=sofa").content)
    x_min, _, _, y_max = map(float, plain.headers["X-OneMap-Bounds"].split(","))
    rows, columns = np.nonzero((heated != fakes.decoded(plain.content)).any(axis=2))
    # the match covers x 0.2 to 0.5 m and y 1.0 to 1.3 m; interpolation adds half a cell, 0.05 m
    np.testing.assert_allclose(x_min + columns.min() / 100, 0.2, atol=0.06)
    np.testing.assert_allclose(x_min + columns.max() / 100, 0.5, atol=0.06)
    np.testing.assert_allclose(y_max - rows.max() / 100, 1.0, atol=0.06)
    np.testing.assert_allclose(y_max - rows.min() / 100, 1.3, atol=0.06)


def test_the_heatmap_of_a_sentence_is_that_of_its_object(client: TestClient) -> None:
    address = "/v1/map.png?marks=false&text="
    sofa = client.get(f"{address}sofa")
    assert client.get(f"{address}the sofa next to the desk").content == sofa.content
    refused = client.get(f"{address}two sofas")
    assert (refused.status_code, refused.json()["type"]) == (422, "/docs#problem-invalid")


def test_the_image_may_show_the_similarity_to_an_image(router: MemoryRouter) -> None:
    mapper = fakes.FakeMapper(router)
    with fakes.client_on(router) as client:
        text = client.get("/v1/map.png?marks=false&scale=4&text=sofa")
        body = {"image": b64encode(PNG).decode()}
        image = client.post("/v1/map.png?marks=false&scale=4", json=body)
    assert mapper.images == [PNG]
    assert image.headers["Content-Type"] == "image/png"
    assert image.headers["X-OneMap-Bounds"] == text.headers["X-OneMap-Bounds"]
    np.testing.assert_array_equal(fakes.decoded(image.content), fakes.decoded(text.content))
    mapper.bus.close()


def test_the_map_in_numbers_and_arrays_and_cleared(client: TestClient) -> None:
    info = client.get("/v1/map").json()
    assert info["revision"] == 7
    assert info["bounds_m"] == pytest.approx([-1.0, -0.5, 3.0, 2.5])
    answer = client.get("/v1/map.npz?text=sofa")
    assert "map.npz" in answer.headers["Content-Disposition"]
    with np.load(io.BytesIO(answer.content), allow_pickle=False) as archive:
        assert archive["occupancy"].shape == archive["similarity"].shape == (40, 30)
    assert client.post("/v1/map/clear").json()["cells_observed"] == 315


def test_a_map_is_saved_listed_loaded_and_deleted(
    client: TestClient, mapper: fakes.FakeMapper
) -> None:
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


@pytest.mark.parametrize("name", ["%2e%2e", ".a", "-a", "a%20b", "x" * 65, "a%00", "K%C3%BCche"])
def test_a_name_that_is_no_file_name_is_refused(
    client: TestClient, mapper: fakes.FakeMapper, name: str
) -> None:
    for method, suffix in (("GET", ""), ("PUT", ""), ("DELETE", ""), ("POST", "/load")):
        answer = client.request(method, f"/v1/maps/{name}{suffix}")
        assert answer.status_code == 422, method
        assert "letters (A-Z, a-z), digits, '.', '_' and '-'" in answer.json()["detail"]
    assert mapper.saved == []


def test_a_saved_map_is_merged_where_the_body_says(
    client: TestClient, mapper: fakes.FakeMapper
) -> None:
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


def test_the_camera_shows_the_newest_image_with_its_detections(router: MemoryRouter) -> None:
    robot = router.bus("simulator")
    with fakes.gateway_on(router) as gateway:
        robot.publish(keys.ROBOT_RGBD).put(fakes.rgbd(5))
        robot.publish(keys.DETECTIONS).put(fakes.detections("sofa", sequence=5))
        assert fakes.state_reached(gateway.cache, lambda s: bool(s.frame and s.detections))
        client = fakes.client_of(gateway)
        drawn = client.get("/v1/camera.jpg")
        plain = client.get("/v1/camera.jpg?detections=false")
    assert drawn.headers["X-OneMap-Sequence"] == "5"
    assert fakes.decoded(plain.content).shape == (24, 32, 3)
    edge = (slice(17, 20), 4)  # rows and column of the corner of the box below its label
    np.testing.assert_allclose(fakes.decoded(drawn.content)[edge].mean(axis=0), BOX, atol=60)
    np.testing.assert_allclose(
        fakes.decoded(plain.content)[edge].mean(axis=0), (200, 0, 0), atol=30
    )


def test_a_picture_is_sent_once_as_long_as_it_is_the_same(
    client: TestClient, mapper: fakes.FakeMapper
) -> None:
    mapper.objects.append(fakes.kept_object())
    address = client.get("/v1/objects/3f9a12c4").json()["picture"]
    first = client.get(address)
    assert first.content == fakes.PICTURE
    assert first.headers["Content-Type"] == "image/jpeg"
    assert first.headers["Cache-Control"] == "no-cache"
    known = {"If-None-Match": first.headers["ETag"]}
    again = client.get(address, headers=known)
    assert (again.status_code, again.content) == (304, b"")
    assert again.headers["ETag"] == first.headers["ETag"]
    mapper.objects[0] = replace(fakes.kept_object(), last_seen_ns=5)
    assert client.get(address, headers=known).content == fakes.PICTURE


@pytest.mark.parametrize("address", ["nix", "nix.jpg", "x" * 65, "x" * 65 + ".jpg"])
def test_an_object_that_is_not_there_is_not_found(client: TestClient, address: str) -> None:
    answer = client.get(f"/v1/objects/{address}")
    assert answer.status_code == 404
    assert answer.json()["type"].endswith("unknown_object")
