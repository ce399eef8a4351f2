"""POST /v1/queries."""

from __future__ import annotations

from base64 import b64encode

import pytest
from starlette.testclient import TestClient

from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import MAX_IMAGE_BYTES
from onemap_shared.transport import RequestRejected
from tests.gateway.fakes import (
    GRID,
    FakeMapper,
    client_of,
    client_on,
    gateway_on,
    odometry,
    state_reached,
)
from tests.shared.samples import PNG

IMAGE = b64encode(PNG).decode()


def test_regions_come_back_best_first(client: TestClient) -> None:
    answer = client.post("/v1/queries", json={"text": "sofa"})
    assert answer.status_code == 200
    reply = answer.json()
    assert [region["rank"] for region in reply["regions"]] == [1, 2]
    assert reply["regions"][0]["centre_m"] == pytest.approx([0.35, 1.15])
    assert reply["regions"][1]["variance"] is None  # infinite: JSON has no such number
    assert reply["revision"] == 7
    assert reply["age_s"] > 0
    assert reply["grid"] is None


def test_what_is_not_there_gets_a_sentence_instead_of_regions(client: TestClient) -> None:
    answer = client.post("/v1/queries", json={"text": "kite"})
    assert answer.status_code == 200
    reply = answer.json()
    assert reply["regions"] == []
    assert reply["best_score"] == pytest.approx(0.199)
    assert reply["message"] == (
        "Nothing on the map looks like 'kite': the best score is 0.19, and answers begin at 0.20. "
        "Did you mean 'ball' or 'fan'?"
    )
    assert reply["did_you_mean"] == ["ball", "fan"]


def test_what_is_there_gets_no_sentence(client: TestClient) -> None:
    reply = client.post("/v1/queries", json={"text": "sofa"}).json()
    assert (reply["best_score"], reply["message"], reply["did_you_mean"]) == (0.9, "", [])


def test_fewer_regions_if_asked(client: TestClient) -> None:
    answer = client.post("/v1/queries", json={"text": "sofa", "max_regions": 1})
    assert len(answer.json()["regions"]) == 1


def test_the_grid_comes_on_request_with_null_for_unseen(client: TestClient) -> None:
    answer = client.post("/v1/queries", json={"text": "sofa", "include_grid": True})
    grid = answer.json()["grid"]
    assert grid["shape"] == list(GRID.shape)
    assert grid["origin_m"] == pytest.approx([-1.0, -0.5])
    assert grid["scores"][0][0] is None
    assert grid["scores"][13][16] == pytest.approx(0.9)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "empty"),
        ("   \t\n", "empty"),
        ("x" * 10_000, "10000 characters"),
        ("1234", "no readable word"),
        ("so\x00fa", "no readable word"),
        (5, "string"),
        (None, "exactly one of"),
        (["sofa"], "string"),
        ({"a": 1}, "string"),
        (True, "string"),
    ],
)
def test_what_is_no_name_is_refused_with_the_reason(
    client: TestClient, text: object, reason: str
) -> None:
    answer = client.post("/v1/queries", json={"text": text})
    assert answer.status_code == 422
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert reason in answer.json()["detail"]


@pytest.mark.parametrize("regions", [0, 101, -1, "many", 1.5, None])
def test_a_number_of_regions_that_cannot_be_is_refused(client: TestClient, regions: object) -> None:
    answer = client.post("/v1/queries", json={"text": "sofa", "max_regions": regions})
    assert answer.status_code == 422
    assert "max_regions" in answer.json()["detail"]


def test_text_that_is_half_a_character_is_refused(client: TestClient) -> None:
    body = b'{"text": "\\ud800"}'
    answer = client.post("/v1/queries", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == 422
    assert "no readable word" in answer.json()["detail"]


@pytest.mark.parametrize(
    ("body", "status"),
    [(b"", 422), (b"{", 400), (b"\xff\xfe", 400), (b"[1]", 422), (b'"sofa"', 422), (b"null", 422)],
)
def test_a_body_that_is_no_request_is_refused(client: TestClient, body: bytes, status: int) -> None:
    answer = client.post("/v1/queries", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == status
    assert answer.json()["detail"]


def test_an_unknown_word_is_the_clients_to_change(client: TestClient) -> None:
    answer = client.post("/v1/queries", json={"text": "flurb"})
    assert answer.status_code == 422
    assert "flurb" in answer.json()["detail"]
    assert answer.json()["type"].endswith("unknown_word")


def test_spaces_do_not_matter(client: TestClient) -> None:
    assert client.post("/v1/queries", json={"text": "  sofa "}).json()["text"] == "sofa"


def test_a_killed_mapper_is_named_and_missed_only_until_it_is_back(router: MemoryRouter) -> None:
    mapper = FakeMapper(router)
    with client_on(router) as client:
        assert client.post("/v1/queries", json={"text": "sofa"}).status_code == 200
        mapper.bus.close()
        answer = client.post("/v1/queries", json={"text": "sofa"})
        assert answer.status_code == 503
        assert answer.json()["service"] == "mapper"
        mapper = FakeMapper(router)
        assert client.post("/v1/queries", json={"text": "sofa"}).status_code == 200
        mapper.bus.close()


def test_several_texts_get_an_answer_each_in_their_order(client: TestClient) -> None:
    answer = client.post("/v1/queries", json={"texts": ["kite", "sofa", "kettle"]})
    answers = answer.json()["answers"]
    assert [each["text"] for each in answers] == ["kite", "sofa", "kettle"]
    assert [each["verdict"] for each in answers] == ["not_looked_yet", "found", "found"]


def test_one_unknown_word_among_several_refuses_them_all(client: TestClient) -> None:
    answer = client.post("/v1/queries", json={"texts": ["sofa", "flurb"]})
    assert answer.status_code == 422
    assert "flurb" in answer.json()["detail"]


def test_negatives_area_and_the_robots_place_reach_the_mapper(router: MemoryRouter) -> None:
    mapper = FakeMapper(router)
    with gateway_on(router) as gateway:
        router.bus("robot").publish(keys.ROBOT_ODOMETRY).put(odometry(1.0, 2.0))
        assert state_reached(gateway.cache, lambda state: state.odometry is not None)
        body = {"text": "sofa", "negatives": ["kettle"], "area_m": [0, -1, 2, 3]}
        assert client_of(gateway).post("/v1/queries", json=body).status_code == 200
    (asked,) = mapper.asked
    assert (asked.negatives, asked.area_m) == (("kettle",), (0.0, -1.0, 2.0, 3.0))
    assert asked.robot_xy_m == (1.0, 2.0)


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ({}, "exactly one of 'text'"),
        ({"text": "sofa", "texts": ["bed"]}, "exactly one of 'text'"),
        ({"texts": []}, "texts"),
        ({"texts": ["sofa"] * 21}, "texts"),
        ({"text": "sofa", "negatives": ["bed"] * 11}, "negatives"),
        ({"text": "sofa", "negatives": [""]}, "empty"),
        ({"text": "sofa", "area_m": [0, 0, 1]}, "area_m"),
        ({"text": "sofa", "area_m": [1, 0, 0, 1]}, "x_min < x_max"),
        ({"text": "sofa", "area_m": [0, 0, 1, 1e9]}, "area_m"),
        ({"text": "sofa", "image": IMAGE}, "exactly one of 'text'"),
        ({"image": IMAGE, "negatives": ["bed"]}, "negatives"),
        ({"image": 5}, "must be a string"),
        ({"image": "söfa"}, "no base64"),
        ({"image": "/9j/4AAQ"}, "no PNG and no JPEG"),
        ({"image": b64encode(b"GIF89a").decode()}, "no PNG and no JPEG"),
        ({"image": b64encode(PNG.replace(b"\x40", b"\x08")).decode()}, "8 x 48 pixels"),
        ({"image": b64encode(bytes(MAX_IMAGE_BYTES + 1)).decode()}, "the limit is 524288"),
    ],
)
def test_what_cannot_be_asked_is_refused_with_the_reason(
    client: TestClient, body: dict[str, object], reason: str
) -> None:
    answer = client.post("/v1/queries", json=body)
    assert answer.status_code == 422
    assert reason in answer.json()["detail"]


@pytest.mark.parametrize(
    "written", [IMAGE, f"data:image/png;base64,{IMAGE}", f"{IMAGE[:8]}\n{IMAGE[8:]}"]
)
def test_an_image_is_asked_for_as_a_text_is(router: MemoryRouter, written: str) -> None:
    mapper = FakeMapper(router)
    with client_on(router) as client:
        body = {"image": written, "area_m": [0, -1, 2, 3], "max_regions": 1}
        reply = client.post("/v1/queries", json=body).json()
    assert mapper.images == [PNG]
    assert (mapper.asked[0].area_m, len(reply["regions"])) == ((0.0, -1.0, 2.0, 3.0), 1)
    assert (reply["text"], reply["calibrated"]) == ("image", False)
    assert reply["sentence"].startswith("What the image shows is at (0.35, 1.15) m")
    mapper.bus.close()


def test_the_score_of_a_text_says_whether_it_is_a_probability(client: TestClient) -> None:
    assert client.post("/v1/queries", json={"text": "sofa"}).json()["calibrated"] is True


@pytest.mark.parametrize("code", ["bad_image", "no_image_queries"])
def test_an_image_that_perception_refuses_is_the_clients_to_change(
    router: MemoryRouter, code: str
) -> None:
    mapper = FakeMapper(router, image_problem=RequestRejected(code, "why: do this"))
    with client_on(router) as client:
        answer = client.post("/v1/queries", json={"image": IMAGE})
    assert (answer.status_code, answer.json()["type"]) == (422, f"/docs#problem-{code}")
    assert "do this" in answer.json()["detail"]
    mapper.bus.close()


def test_the_largest_image_fits_into_a_body(router: MemoryRouter) -> None:
    mapper = FakeMapper(router)
    image = PNG + bytes(MAX_IMAGE_BYTES - len(PNG))
    with client_on(router) as client:
        body = {"image": b64encode(image).decode()}
        assert client.post("/v1/queries", json=body).status_code == 200
    assert mapper.images == [image]
    mapper.bus.close()
