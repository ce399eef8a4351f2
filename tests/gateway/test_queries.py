"""Queries over HTTP."""

from __future__ import annotations

from base64 import b64encode

import pytest
from starlette.testclient import TestClient

from onemap_shared import keys
from onemap_shared.messages import MAX_IMAGE_BYTES
from tests.gateway.fakes import (
    FakeMapper,
    client_of,
    client_on,
    gateway_on,
    odometry,
    state_reached,
)
from tests.memory_bus import MemoryRouter
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
        ({"texts": ["sofa"] * 21}, "texts"),
        ({"text": "sofa", "negatives": ["bed"] * 11}, "negatives"),
        ({"text": "sofa", "area_m": [1, 0, 0, 1]}, "x_min < x_max"),
        ({"text": "sofa", "area_m": [0, 0, 1, 1e9]}, "area_m"),
        ({"text": "sofa", "image": IMAGE}, "exactly one of 'text'"),
        ({"image": IMAGE, "negatives": ["bed"]}, "negatives"),
        ({"image": 5}, "must be a string"),
        ({"image": "söfa"}, "no base64"),
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
