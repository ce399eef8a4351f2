"""What clients send: checked before any service is called."""

from __future__ import annotations

from base64 import b64decode
from itertools import combinations

import pytest
from pydantic import ValidationError

from onemap_gateway.http.schemas import (
    EXAMPLE_PNG,
    MapName,
    QueryRequest,
    RequestModel,
    SearchStart,
)
from onemap_perception.encoders.images import decoded
from onemap_shared.messages import (
    MAX_OBJECTS,
    MAX_TEXT_CHARS,
    SearchKind,
    SearchOrder,
    SearchRequest,
)


def test_the_example_of_an_image_can_be_asked_for() -> None:
    assert decoded(b64decode(EXAMPLE_PNG, validate=True)).shape == (32, 32, 3)


def test_a_search_names_one_object_or_a_list_in_order() -> None:
    assert SearchStart(object="sofa").names == ("sofa",)
    assert SearchStart(objects=["sofa", "kettle"]).names == ("sofa", "kettle")


@pytest.mark.parametrize(
    "body",
    [{}, {"object": "sofa", "objects": ["sofa"]}, {"objects": ["sofa"] * (MAX_OBJECTS + 1)}],
    ids=["none", "both", "too many"],
)
def test_a_search_for_none_for_both_or_for_too_many_is_refused(body: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        SearchStart.model_validate(body)


MEMBERS: dict[str, object] = {
    "objects": ["sofa"],
    "object": "sofa",
    "go_to_m": [1, -2.5],
    "look_at_m": [1, -2.5],
}


def test_a_search_has_exactly_one_of_four_members() -> None:
    for name, value in MEMBERS.items():
        SearchStart.model_validate({name: value})
    for both in combinations(MEMBERS, 2):
        with pytest.raises(ValidationError, match="exactly one of"):
            SearchStart.model_validate({name: MEMBERS[name] for name in both})


def test_a_place_becomes_a_request_without_objects() -> None:
    go = SearchStart.model_validate({"go_to_m": [1, -2.5]}).request(3.0)
    assert go == SearchRequest((), 3.0, SearchKind.GO_TO, (1.0, -2.5))
    look = SearchStart.model_validate({"look_at_m": [1, -2.5]}).request(3.0)
    assert look == SearchRequest((), 3.0, SearchKind.LOOK_AT, (1.0, -2.5))
    assert SearchStart(object="sofa").request(3.0) == SearchRequest(("sofa",), 3.0)


def test_a_search_may_have_limits() -> None:
    limits = {"max_distance_m": 20, "max_time_s": 90.5}
    request = SearchStart.model_validate({"object": "sofa", **limits}).request(3.0)
    assert (request.max_distance_m, request.max_time_s) == (20.0, 90.5)
    for name in limits:
        for value in (0, -1, "5", float("nan"), 1e7):
            with pytest.raises(ValidationError):
                SearchStart.model_validate({"object": "sofa", name: value})


@pytest.mark.parametrize(
    "place", [[], [1], [1, 2, 3], ["1", "2"], [1, None], [1, float("nan")], [2e5, 0], "1, 2", 1]
)
def test_what_is_no_place_is_refused(place: object) -> None:
    with pytest.raises(ValidationError):
        SearchStart.model_validate({"go_to_m": place})


@pytest.mark.parametrize("text", ["", "  ", "x" * (MAX_TEXT_CHARS + 1), 5, None])
def test_a_text_that_no_service_takes_is_refused(text: object) -> None:
    with pytest.raises(ValidationError):
        QueryRequest.model_validate({"text": text})


@pytest.mark.parametrize("name", ["flat", "Flat-2.npz", "0", "x" * 64])
def test_a_map_may_have_a_plain_file_name(name: str) -> None:
    assert MapName(name=name).name == name


@pytest.mark.parametrize("name", ["", "-flat", ".flat", "a/b", "a b", "flat\n", "x" * 65])
def test_a_map_may_not_have_any_other_name(name: str) -> None:
    with pytest.raises(ValidationError, match="begins with a letter or a digit"):
        MapName(name=name)


@pytest.mark.parametrize("model", RequestModel.__subclasses__())
def test_the_examples_fit_and_unknown_fields_do_not(model: type[RequestModel]) -> None:
    for example in model.model_json_schema()["examples"]:
        model.model_validate(example)
        with pytest.raises(ValidationError, match="extra_forbidden"):
            model.model_validate({**example, "speed": 3})


def test_objects_may_be_sought_in_any_order() -> None:
    names = ["sofa", "kettle"]
    given = SearchStart.model_validate({"objects": names}).request(3.0)
    assert given.order is SearchOrder.GIVEN
    body = {"objects": names, "order": "any"}
    assert SearchStart.model_validate(body).request(3.0).order is SearchOrder.ANY


@pytest.mark.parametrize(
    "body", [{"go_to_m": [1, 2], "order": "any"}, {"objects": ["sofa"], "order": "nearest"}]
)
def test_a_place_has_no_order_and_no_other_order_is_known(body: dict[str, object]) -> None:
    with pytest.raises(ValidationError, match="order"):
        SearchStart.model_validate(body)
