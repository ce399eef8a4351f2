"""The documentation of problems agrees with the problems that are sent."""

from __future__ import annotations

from onemap_gateway.http.problems import (
    MEDIA_TYPE,
    PROBLEM_STATUSES,
    PROBLEM_TYPES,
    ProblemDetails,
    from_call_error,
    problem_responses,
)
from onemap_shared.transport import NoReply


def test_the_example_is_what_an_absent_mapper_causes() -> None:
    (example,) = ProblemDetails.model_json_schema()["examples"]
    assert from_call_error(NoReply(), "mapper", 3.0, lambda _service: "").document == example


def test_every_documented_status_is_that_of_a_problem() -> None:
    assert set(PROBLEM_STATUSES) <= {known.status for known in PROBLEM_TYPES.values()}


def test_responses_are_described_and_have_the_media_type_that_is_sent() -> None:
    responses = problem_responses(404, 503)
    assert list(responses) == [404, 503]
    for response in responses.values():
        assert response["description"]
        assert list(response["content"]) == [MEDIA_TYPE]
