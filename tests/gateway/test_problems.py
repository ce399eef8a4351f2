"""Problems in words, and which one the failure of a call is."""

from __future__ import annotations

import json
from typing import Any

import anyio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from starlette.testclient import TestClient

from onemap_gateway.http import problems
from onemap_shared import keys
from onemap_shared.keys import Procedure
from onemap_shared.messages import MapClear, MapSummary, SearchViewRequest
from onemap_shared.transport import CallError, NoReply, QueryTimeout, RemoteError, RequestRejected
from tests.gateway.fakes import FakeMapper, gateway_on
from tests.memory_bus import MemoryRouter


def no_hung(_service: str) -> str:
    return ""


services = st.sampled_from(["mapper", "planner", "perception"])
errors = st.one_of(
    st.just(NoReply("x")),
    st.just(QueryTimeout("x")),
    st.builds(RemoteError, st.sampled_from([*problems.PROBLEM_TYPES, "nobody knows"]), st.text()),
)


@given(errors, services)
def test_a_failed_call_is_always_a_whole_problem(error: CallError, service: str) -> None:
    problem = problems.from_call_error(error, service, 2.0, no_hung)
    document = problem.document
    assert {"type", "title", "status", "detail"} <= document.keys()
    assert document["type"] == f"/docs#problem-{problem.code}"
    assert document["status"] == problem.status == problems.problem_response(problem).status_code
    assert document["detail"][-1] in ".!?"
    assert document["service"] == service
    assert ("Retry-After" in problem.headers) == (problem.status in (429, 503))
    assert json.loads(bytes(problems.problem_response(problem).body)) == document


@pytest.mark.parametrize(
    ("body", "status", "fields"),
    [
        ('{"text": "sofa", "regions": 3}', 422, {"regions": "'regions' is no field of this"}),
        ('{"text": 5, "max_regions": 0}', 422, {"text": "'text': ", "max_regions": "'max_reg"}),
        ('{"texts": [], "area_m": 1}', 422, {"texts": "'texts' has 0 entries; give at least 1",
                                              "area_m": "'area_m' must be a list"}),
        ('{"text": ', 400, {}),
    ],
)  # fmt: skip
def test_every_wrong_field_is_named_with_the_reason(
    client: TestClient, body: str, status: int, fields: dict[str, str]
) -> None:
    headers = {"Content-Type": "application/json"}
    problem = client.post("/v1/queries", content=body, headers=headers).json()
    assert problem["status"] == status
    told = {each["field"]: each["reason"] for each in problem.get("errors", [])}
    assert told.keys() == fields.keys()
    assert all(told[field].startswith(reason) for field, reason in fields.items())


@given(st.text())
def test_what_was_sent_is_not_repeated(text: str) -> None:
    marker = "marker" + text + "marker"
    error = {"type": "string_type", "loc": ("body", "text"), "msg": "no text", "input": marker}
    assert marker not in json.dumps(problems.from_validation_errors([error]).document)


def test_an_answer_that_cannot_be_read_is_a_problem_of_its_service(
    client: TestClient, mapper: FakeMapper
) -> None:
    foreign = Procedure(keys.MAP_SEARCH_VIEW.key, SearchViewRequest, SearchViewRequest)
    mapper.bus.serve(foreign, lambda asked: asked)
    reply = client.get("/v1/map.npz")
    assert (reply.status_code, reply.json()["service"]) == (502, "mapper")
    assert "cannot be read" in reply.json()["detail"]


def call_problem(
    router: MemoryRouter, procedure: Procedure[Any, Any] = keys.SEARCH_GET
) -> problems.HttpProblem:
    """The problem that a call of ``procedure`` ends with."""
    with gateway_on(router) as gateway, pytest.raises(problems.HttpProblem) as problem:
        anyio.run(gateway.call, procedure, procedure.request())
    return problem.value


def hang(router: MemoryRouter, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every service pass for one that hangs."""
    monkeypatch.setattr(
        "onemap_gateway.http.context.hung_problem", lambda name, _state, _now_s: f"{name} hangs."
    )


def test_a_service_that_starts_is_unavailable_until_it_has() -> None:
    says = "The mapper is starting, for 7 s so far."
    problem = problems.from_call_error(NoReply(), "mapper", 3.0, no_hung, lambda _service: says)
    assert (problem.status, problem.detail) == (503, says)


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
