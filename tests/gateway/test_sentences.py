"""Sentences and their parts in queries, searches and the agents' tools."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.messages import Detail, Relation, RelationKind
from onemap_shared.transport import RequestRejected
from tests.gateway.fakes import FakeMapper, FakePlanner, client_of, gateway_on
from tests.memory_bus import MemoryRouter
from tests.shared.samples import SAMPLES

NEAR_BED = Relation(RelationKind.NEXT_TO, ("bed",))
WORDS = "red sofa, within 1 m of a bed, in the kitchen, not in the hall (as soon as one is known)"
DETAIL = Detail("red", (NEAR_BED,), ("Kitchen",), ("hall",))
SENTENCE = "the red sofa next to the bed in the kitchen, not in the hall"
PARTS = {"near": "a bed", "in": ["kitchen"], "not_in": "the hall", "colour": "red"}


@pytest.mark.parametrize("asked", [{"text": SENTENCE}, {"text": "sofa", **PARTS}])
def test_a_query_takes_a_sentence_or_its_parts(
    client: TestClient, mapper: FakeMapper, asked: dict[str, Any]
) -> None:
    mapper.places = ("kitchen",)
    reply = client.post("/v1/queries", json=asked).json()
    assert reply["text"] == asked["text"]
    assert reply["understood"] == WORDS
    assert mapper.asked[-1].text == "sofa"
    assert mapper.asked[-1].detail == replace(DETAIL, inside=("kitchen",))
    several = {"texts": ["sofa", asked, {"text": "kettle", "on": "table"}]}
    answers = client.post("/v1/queries", json=several).json()["answers"]
    said = [each["understood"] for each in answers]
    assert said == ["sofa, anywhere", WORDS, "kettle, on a table, anywhere"]


def test_the_map_is_asked_for_places_only_if_a_sentence_names_one(
    client: TestClient, mapper: FakeMapper
) -> None:
    client.post("/v1/queries", json={"text": "red sofa on the bed"})
    assert mapper.asked_places == 0
    client.post("/v1/queries", json={"text": "sofa in ada's den"})
    assert mapper.asked_places == 1
    assert mapper.asked[-1].detail == Detail(inside=("Ada's den",))
    client.post("/v1/queries", json={"text": "sofa in a box"})
    assert mapper.asked[-1].detail == Detail(relations=(Relation(RelationKind.IN, ("box",)),))


@pytest.mark.parametrize(
    "asked",
    [
        {"object": f"{SENTENCE}, stay out of Ada's den"},
        {"object": "sofa", **PARTS, "stay_out_of": ["ada's den"]},
        {"objects": [{"text": "sofa", **PARTS, "stay_out_of": "Ada's den"}]},
    ],
)
def test_a_search_takes_a_sentence_or_its_parts(
    client: TestClient, planner: FakePlanner, mapper: FakeMapper, asked: dict[str, Any]
) -> None:
    reply = client.post("/v1/searches", json=asked)
    assert reply.status_code == 201
    (request,) = planner.requests
    assert (request.objects, request.details) == (("sofa",), (DETAIL,))
    assert request.stay_out == ("Ada's den",)
    said = WORDS.replace("the kitchen", "Kitchen")
    assert reply.json()["understood"] == f"{said}, staying out of Ada's den"
    later = client.get("/v1/searches/s1").json()
    assert later["understood"] == reply.json()["understood"].replace(
        " (as soon as one is known)", ""
    )
    planner.move(m.SearchState.INTERRUPTED, "the planner was stopped")
    assert client.post("/v1/searches", json={"objects": later["left"]}).status_code == 201
    again = replace(planner.requests[1], age_s=request.age_s, patience_s=request.patience_s)
    assert again == request


@pytest.mark.parametrize(
    ("asked", "code", "words"),
    [
        ({"object": "lamp behind the sofa"}, "invalid", "'behind the sofa' is not understood"),
        ({"objects": ["bed", "lamp near"]}, "invalid", "'near' is not understood"),
        ({"object": "lamp", "near": "red sofa"}, "invalid", "'near red sofa' is not understood"),
        ({"object": "lamp", "colour": "mauve"}, "invalid", "'mauve' is not understood"),
        ({"object": "lamp", "between": ["bed"]}, "invalid", "'between bed' is not understood"),
        ({"objects": ["lamp"], "near": "bed"}, "invalid", "'near' describes a single 'object'"),
        ({"go_to_m": [1, 2], "in": "hall"}, "invalid", "'in' describes a single 'object'"),
        ({"object": "cup in the west wing, not in my bunker"}, "unknown_place", "'my bunker'"),
        ({"object": "cup", "stay_out_of": "hall"}, "unknown_place", "knows no place 'hall'"),
    ],
)
def test_what_is_not_understood_is_refused_with_its_words(
    client: TestClient, planner: FakePlanner, asked: dict[str, Any], code: str, words: str
) -> None:
    reply = client.post("/v1/searches", json=asked)
    problem = reply.json()
    assert (reply.status_code, problem["type"]) == (422, f"/docs#problem-{code}")
    assert words in problem["detail"]
    if code == "unknown_place":
        assert problem["places"] == ["Kitchen", "Ada's den"]
        assert "its places are 'Kitchen', \"Ada's den\"" in problem["detail"]
    assert planner.requests == []


def test_a_query_keeps_out_of_nothing(client: TestClient) -> None:
    reply = client.post("/v1/queries", json={"text": "sofa", "stay_out_of": ["kitchen"]})
    assert reply.status_code == 422
    assert "moves no robot" in reply.json()["detail"]


def test_a_description_stands_for_names(router: MemoryRouter, mapper: FakeMapper) -> None:
    text = "something to sit on"
    mapper.vocabulary |= {text}
    sample = next(each for each in SAMPLES if isinstance(each, m.TextEmbeddings))
    with gateway_on(router) as gateway:
        client = client_of(gateway)
        reply = client.post("/v1/queries", json={"text": text})
        assert (reply.status_code, reply.json()["service"]) == (503, "perception")

        def embed(request: m.TextRequest) -> m.TextEmbeddings:
            if request.texts != (text,):
                raise RequestRejected("unknown_word", "it is like nothing")
            one = sample.only(np.zeros(1, np.int64))
            return replace(one, texts=(text,), stands_for=(("chair", "sofa"),))

        router.bus("perception").serve(keys.EMBED_TEXT, embed)
        reply = client.post("/v1/queries", json={"text": text, "in": "kitchen"}).json()
        assert reply["stands_for"] == ["chair", "sofa"]
        assert reply["understood"] == f"{text} (probably a chair or a sofa), in Kitchen"
        read = client.get("/v1/words", params={"text": f"{text}"}).json()
        assert read == {
            "texts": [text],
            "understood": f"{text} (probably a chair or a sofa), anywhere",
            "stands_for": ["chair", "sofa"],
        }
        read = client.get("/v1/words", params={"text": f"{text} that is not a sofa"}).json()
        assert read["understood"] == f"{text} (probably a chair), not a sofa, anywhere"
        assert read["stands_for"] == ["chair"]
        refused = client.get("/v1/words", params={"text": "something to fly with"})
        assert refused.json()["type"] == "/docs#problem-unknown_word"


def test_an_address_asks_how_a_sentence_is_understood(client: TestClient) -> None:
    read = client.get("/v1/words", params={"text": "lamp on the bed"}).json()
    texts = ["lamp on the bed"]
    assert read == {"texts": texts, "understood": "lamp, on a bed, anywhere", "stands_for": []}
    several = client.get("/v1/words", params={"text": "find the bed, then a red sofa"}).json()
    assert several["texts"] == ["find the bed", "a red sofa"]
    assert several["understood"] == "bed, anywhere; red sofa, anywhere"
    refused = client.get("/v1/words", params={"text": "lamp over the bed"})
    assert (refused.status_code, "'over the bed'" in refused.json()["detail"]) == (422, True)
