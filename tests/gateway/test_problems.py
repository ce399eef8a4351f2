"""Problems in words, and which one the failure of a call is."""

from __future__ import annotations

import json
from typing import Any

import anyio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError

from onemap_gateway.http.problems import (
    PROBLEM_TYPES,
    HttpProblem,
    ProblemDetails,
    from_call_error,
    from_validation_errors,
    problem_response,
)
from onemap_gateway.http.schemas import QueryRequest
from onemap_shared import keys
from onemap_shared.keys import Procedure
from onemap_shared.messages import MapClear, MapSummary
from onemap_shared.transport import CallError, NoReply, QueryTimeout, RemoteError, RequestRejected
from tests.gateway.fakes import gateway_on
from tests.memory_bus import MemoryRouter


def no_hung(_service: str) -> str:
    return ""


services = st.sampled_from(["mapper", "planner", "perception"])
errors = st.one_of(
    st.just(NoReply("x")),
    st.just(QueryTimeout("x")),
    st.builds(RemoteError, st.sampled_from([*PROBLEM_TYPES, "nobody knows"]), st.text()),
)


@given(errors, services)
def test_a_failed_call_is_always_a_whole_problem(error: CallError, service: str) -> None:
    problem = from_call_error(error, service, 2.0, no_hung)
    document = problem.document
    assert {"type", "title", "status", "detail"} <= document.keys()
    assert document["type"] == f"/docs#problem-{problem.code}"
    assert document["status"] == problem.status == problem_response(problem).status_code
    assert document["detail"][-1] in ".!?"
    assert document["service"] == service
    assert json.loads(bytes(problem_response(problem).body)) == document


@pytest.mark.parametrize(
    ("code", "status"),
    [
        ("invalid", 422),
        ("conflict", 409),
        ("unknown_search", 404),
        ("unknown_map", 404),
        ("unknown_word", 422),
        ("empty_map", 409),
        ("encoder_mismatch", 409),
        ("not_found", 404),
        ("unavailable", 503),
        ("timeout", 503),
        ("storage", 507),
        ("internal", 502),
        ("something new", 502),
    ],
)
def test_the_codes_of_services_have_their_status(code: str, status: int) -> None:
    problem = from_call_error(RemoteError(code, "the reason"), "mapper", 2.0, no_hung)
    assert problem.status == status
    assert "he reason." in problem.detail


@pytest.mark.parametrize("error", [NoReply(""), QueryTimeout("")])
def test_a_missing_service_is_503_and_says_when_to_try_again(error: CallError) -> None:
    problem = from_call_error(error, "planner", 2.0, no_hung)
    assert problem.status == 503
    assert "planner" in problem.detail
    assert "Retry-After" in problem.headers


def refused(model: type[BaseModel], text: str) -> HttpProblem:
    with pytest.raises(ValidationError) as refusal:
        model.model_validate_json(text)
    found = [{**error, "loc": ("body", *error["loc"])} for error in refusal.value.errors()]
    return from_validation_errors(found)


def test_a_wrong_field_is_named() -> None:
    problem = refused(QueryRequest, '{"text": "sofa", "regions": 3}')
    assert problem.status == 422
    assert problem.detail.startswith("'regions' is no field of this request")


def test_all_wrong_fields_are_listed() -> None:
    problem = refused(QueryRequest, '{"text": 5, "max_regions": 0}')
    fields = [error["field"] for error in problem.extra["errors"]]
    assert fields == ["text", "max_regions"]


def test_a_body_that_is_no_json_is_a_bad_request() -> None:
    assert refused(QueryRequest, '{"text": ').status == 400


@given(st.text())
def test_what_was_sent_is_not_repeated(text: str) -> None:
    marker = "marker" + text + "marker"
    error = {"type": "string_type", "loc": ("body", "text"), "msg": "no text", "input": marker}
    assert marker not in json.dumps(from_validation_errors([error]).document)


def test_the_example_is_what_an_absent_mapper_causes() -> None:
    (example,) = ProblemDetails.model_json_schema()["examples"]
    assert from_call_error(NoReply(), "mapper", 3.0, lambda _service: "").document == example


def call_problem(
    router: MemoryRouter, procedure: Procedure[Any, Any] = keys.SEARCH_GET
) -> HttpProblem:
    """The problem that a call of ``procedure`` ends with."""
    with gateway_on(router) as gateway, pytest.raises(HttpProblem) as problem:
        anyio.run(gateway.call, procedure, procedure.request())
    return problem.value


def hang(router: MemoryRouter, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every service pass for one that hangs."""
    monkeypatch.setattr(
        "onemap_gateway.http.context.hung_problem", lambda name, _state, _now_s: f"{name} hangs."
    )


def test_an_absent_service_that_hangs_is_a_timeout(
    router: MemoryRouter, monkeypatch: pytest.MonkeyPatch
) -> None:
    hang(router, monkeypatch)
    problem = call_problem(router)
    assert (problem.code, problem.extra["service"]) == ("timeout", "planner")
    assert problem.detail == "planner hangs."


def test_a_hung_service_behind_the_one_called_is_named(
    router: MemoryRouter, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_request: MapClear) -> MapSummary:
        raise RequestRejected("perception_missing", "perception does not run")

    hang(router, monkeypatch)
    router.bus("mapper").serve(keys.MAP_CLEAR, refuse)
    problem = call_problem(router, keys.MAP_CLEAR)
    assert (problem.code, problem.extra["service"]) == ("timeout", "perception")
    assert problem.detail == "perception hangs."
