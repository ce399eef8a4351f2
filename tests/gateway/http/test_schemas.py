"""What clients send: checked before any service is called."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from onemap_gateway.http.schemas import MapName, QueryRequest, RequestModel, SearchStart
from onemap_shared.messages import MAX_OBJECTS, MAX_TEXT_CHARS


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
