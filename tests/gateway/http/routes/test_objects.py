"""/v1/objects: what was found, with its pictures."""

from __future__ import annotations

from dataclasses import replace

import pytest
from starlette.testclient import TestClient

from onemap_shared.memory_bus import MemoryRouter
from tests.gateway.fakes import PICTURE, FakeMapper, client_of, gateway_on, kept_object


def test_objects_are_listed_as_the_mapper_keeps_them(
    client: TestClient, mapper: FakeMapper
) -> None:
    mapper.objects += [kept_object(), kept_object("00ff00ff", "sofa")]
    reply = client.get("/v1/objects").json()
    assert [known["name"] for known in reply["objects"]] == ["bed", "sofa"]
    assert reply["left_out"] == 1
    assert client.get("/v1/objects/00ff00ff").json() == reply["objects"][1]


def test_an_object_can_be_forgotten(client: TestClient, mapper: FakeMapper) -> None:
    mapper.objects += [kept_object(), kept_object("00ff00ff", "sofa")]
    assert client.delete("/v1/objects/3f9a12c4").json()["name"] == "bed"
    assert [kept.object_id for kept in mapper.objects] == ["00ff00ff"]
    gone = client.delete("/v1/objects/3f9a12c4")
    assert gone.status_code == 404
    assert gone.json()["type"].endswith("unknown_object")


def test_a_picture_is_sent_once_as_long_as_it_is_the_same(
    client: TestClient, mapper: FakeMapper
) -> None:
    mapper.objects.append(kept_object())
    address = client.get("/v1/objects/3f9a12c4").json()["picture"]
    first = client.get(address)
    assert first.content == PICTURE
    assert first.headers["Content-Type"] == "image/jpeg"
    assert first.headers["Cache-Control"] == "no-cache"
    known = {"If-None-Match": first.headers["ETag"]}
    again = client.get(address, headers=known)
    assert (again.status_code, again.content) == (304, b"")
    assert again.headers["ETag"] == first.headers["ETag"]
    mapper.objects[0] = replace(kept_object(), last_seen_ns=5)
    assert client.get(address, headers=known).content == PICTURE


def test_without_a_picture_there_is_none_to_fetch(client: TestClient, mapper: FakeMapper) -> None:
    mapper.objects.append(replace(kept_object(), picture_bytes=0, box_px=()))
    report = client.get("/v1/objects/3f9a12c4").json()
    assert (report["picture"], report["box_px"]) == (None, None)
    missing = client.get("/v1/objects/3f9a12c4.jpg")
    assert missing.status_code == 404
    assert "There is no picture of the object" in missing.json()["detail"]


@pytest.mark.parametrize("address", ["nix", "nix.jpg", "x" * 65, "x" * 65 + ".jpg"])
def test_an_object_that_is_not_there_is_not_found(client: TestClient, address: str) -> None:
    answer = client.get(f"/v1/objects/{address}")
    assert answer.status_code == 404
    assert answer.json()["type"].endswith("unknown_object")


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "/v1/objects"),
        ("GET", "/v1/objects/3f9a12c4"),
        ("GET", "/v1/objects/3f9a12c4.jpg"),
        ("DELETE", "/v1/objects/3f9a12c4"),
    ],
)
def test_without_a_mapper_it_is_named(router: MemoryRouter, method: str, path: str) -> None:
    with gateway_on(router) as gateway:
        answer = client_of(gateway).request(method, path)
    assert answer.status_code == 503
    assert answer.json()["service"] == "mapper"
