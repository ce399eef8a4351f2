"""Errors as problem details (RFC 9457), for people and programs.

Each problem has a code with a fixed status and title; ``detail`` is one sentence that says what
to do. The codes with which services refuse a request are problem codes, too.
"""
# Talks: turns errors of calls into responses.

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError
from starlette.responses import Response

from onemap_gateway.present.formats import json_text
from onemap_gateway.present.service_status import sentence, sentence_subject
from onemap_shared.supervisor import start_hint
from onemap_shared.transport import CallError, NoReply, QueryTimeout, RemoteError

MEDIA_TYPE = "application/problem+json"
RETRY_AFTER_S = 2  # a killed service is back in about this time


# Status and title of each code.
PROBLEM_TYPES: Mapping[str, tuple[int, str]] = {
    "not_json": (400, "The body is not JSON"),
    "unauthorized": (401, "A token is needed"),
    "forbidden": (403, "This token may not do that"),
    "foreign_origin": (403, "The request comes from another site's page"),
    "not_found": (404, "There is no such thing here"),
    "unknown_search": (404, "There is no such search"),
    "unknown_map": (404, "There is no such map"),
    "unknown_object": (404, "There is no such object"),
    "no_such_place": (404, "There is no such place"),
    "method_not_allowed": (405, "This address does not take this method"),
    "slow_body": (408, "The body did not arrive in time"),
    "conflict": (409, "Another search is under way"),
    "stopped": (409, "It was stopped before it began"),
    "nothing_left": (409, "Everything in this search was found"),
    "keep_out": (409, "A keep-out zone is in the way"),
    "no_robot": (409, "A recording moves no robot"),
    "empty_map": (409, "The map is empty"),
    "encoder_mismatch": (409, "The map was made with another encoder"),
    "too_large": (413, "The body is too large"),
    "content_type": (415, "The body must be JSON"),
    "misdirected": (421, "This host name is not served"),
    "invalid": (422, "The request cannot be understood"),
    "bad_image": (422, "The image cannot be searched for"),
    "unknown_place": (422, "There is no such place"),
    "unknown_word": (422, "The encoder does not know this word"),
    "http": (400, "The request was refused"),
    "internal": (500, "The gateway failed"),
    "not_installed": (501, "This part is not installed"),
    "remote": (502, "A service failed"),
    "unavailable": (503, "A service is missing"),
    "timeout": (503, "A service does not answer"),
    "busy": (503, "A service is busy"),
    "unreadable": (503, "A file cannot be read"),
    "not_ready": (503, "The robot's map is not being updated"),
    "storage": (507, "A file cannot be written or deleted"),
}

# Refusals of a service that itself calls another one: the code here, and the service missing.
DEPENDENCY_ERRORS = {
    "perception_missing": ("unavailable", "perception"),
    "perception_silent": ("timeout", "perception"),
}

# Members of the document that the details of a service may not replace.
RESERVED_MEMBERS = frozenset({"type", "title", "status", "detail", "service"})


# What pydantic says in words of its own, by the type of its error.
OBJECT = "one JSON object: /docs has examples"
EXPECTED = {
    "tuple_type": "a list",
    "list_type": "a list",
    "model_type": OBJECT,
    "model_attributes_type": OBJECT,
}


class HttpProblem(Exception):
    """A request that cannot be served, and why; becomes the HTTP response.

    code: key of ``PROBLEM_TYPES``; extra: further members of the problem details object.
    """

    def __init__(self, code: str, detail: str, /, status: int | None = None, **extra: Any) -> None:
        super().__init__(detail)
        self.code = code
        own_status, self.title = PROBLEM_TYPES[code]
        self.status = status or own_status
        self.detail = detail
        self.extra = extra

    @property
    def document(self) -> dict[str, Any]:
        """The problem details object."""
        return {
            "type": f"/docs#problem-{self.code}",
            "title": self.title,
            "status": self.status,
            "detail": self.detail,
            **self.extra,
        }

    @property
    def headers(self) -> dict[str, str]:
        """Headers that belong to the status."""
        if self.status == 503:
            return {"Retry-After": str(self.extra.get("retry_after_s", RETRY_AFTER_S))}
        if self.status == 401:
            return {"WWW-Authenticate": "Bearer"}
        return {}


def from_call_error(
    error: CallError,
    service: str,
    timeout_s: float,
    hung_problem: Callable[[str], str],
    start_problem: Callable[[str], str] = lambda _: "",
) -> HttpProblem:
    """The problem of a call to ``service`` that failed.

    ``hung_problem`` returns a sentence on a service that hangs, or an empty text: the bus cannot
    tell a process that hangs from one that ended, since both lose their connection.
    ``start_problem``: the same for one that is starting.
    """
    known, silent = DEPENDENCY_ERRORS.get(getattr(error, "code", ""), ("", service))
    answered = isinstance(error, RemoteError) and not known
    if not answered and (detail := hung_problem(silent)):
        return HttpProblem("timeout", detail, service=silent)
    match error:
        case NoReply():
            absent = f"{sentence_subject(service)} is not running: {start_hint(service)}."
            detail = start_problem(service) or absent
            return HttpProblem("unavailable", detail, service=service)
        case QueryTimeout():
            detail = (
                f"{sentence_subject(service)} did not answer within {timeout_s:g} s: try again; "
                "if it goes on, 'onemap doctor' says why."
            )
            return HttpProblem("timeout", detail, service=service)
        case RemoteError() if known:
            return HttpProblem(known, sentence(str(error)), service=silent)
        case RemoteError(code=code) if code in PROBLEM_TYPES and code != "internal":
            details = {k: v for k, v in error.details.items() if k not in RESERVED_MEMBERS}
            return HttpProblem(code, sentence(str(error)), service=service, **details)
        case _:
            detail = f"{sentence_subject(service)} failed: {sentence(str(error))}"
            return HttpProblem("remote", detail, service=service)


def from_validation_error(error: ValidationError) -> HttpProblem:
    """The same of what is no request of FastAPI, which names the part of the request first."""
    return from_validation_errors(
        [{**found, "loc": ("body", *found["loc"])} for found in error.errors()]
    )


def from_validation_errors(errors: Sequence[Mapping[str, Any]]) -> HttpProblem:
    """The problem of a request that does not fit its schema, with every wrong field.

    The offending values are not repeated: they may be huge, or not even valid text.
    """
    if any(error["type"] == "json_invalid" for error in errors):
        return HttpProblem(
            "not_json", "The body is not valid JSON: check quotes, commas and braces."
        )
    fields = [{"field": _field_path(error), "reason": _reason(error)} for error in errors]
    return HttpProblem("invalid", sentence("; ".join(f["reason"] for f in fields)), errors=fields)


def _field_path(error: Mapping[str, Any]) -> str:
    # The first part says body, path or query: the reader sees that from the name.
    names = [f"[{part}]" if isinstance(part, int) else f".{part}" for part in error["loc"][1:]]
    return "".join(names).removeprefix(".")


def _reason(error: Mapping[str, Any]) -> str:
    place = _field_path(error)
    match error["type"]:
        case "extra_forbidden":
            return f"{place!r} is no field of this request: remove it or correct its name"
        case "missing":
            return f"{place!r} is missing" if place else "this request needs a JSON body"
        case "too_short" | "too_long":
            limits = error["ctx"]
            least, most = limits.get("min_length", 0), limits.get("max_length")
            wanted = f"at least {least}" if error["type"] == "too_short" else f"at most {most}"
            return f"{place!r} has {limits['actual_length']} entries; give {wanted}"
        case kind if kind in EXPECTED:
            return f"{repr(place) if place else 'the body'} must be {EXPECTED[kind]}"
        case "value_error":  # the schema's own sentence
            return str(error["msg"]).removeprefix("Value error, ")
        case _:
            reason = str(error["msg"])
            return f"{place!r}: {reason[0].lower()}{reason[1:]}" if place else reason


def problem_response(problem: HttpProblem) -> Response:
    """The problem as ``application/problem+json``."""
    body = json_text(problem.document).encode("ascii")
    return Response(body, problem.status, problem.headers, MEDIA_TYPE)


class ProblemDetails(BaseModel):
    """RFC 9457: what went wrong, and in ``detail`` what to do about it."""

    model_config = ConfigDict(
        extra="allow",
        json_schema_extra={
            "examples": [
                {
                    "type": "/docs#problem-unavailable",
                    "title": "A service is missing",
                    "status": 503,
                    "detail": "The mapper is not running: start it with 'onemap service "
                    "mapper' and the same --config, or see 'onemap status'.",
                    "service": "mapper",
                }
            ]
        },
    )

    type: str
    title: str
    status: int
    detail: str


def problem_responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """OpenAPI entries of the problems with which an operation may respond."""
    schema = {"$ref": "#/components/schemas/ProblemDetails"}
    return {
        status: {
            "description": PROBLEM_STATUSES[status],
            "content": {"application/problem+json": {"schema": schema}},
        }
        for status in statuses
    }


def content(media_type: str, description: str = "", **schema: str) -> dict[str, Any]:
    """OpenAPI entry of a reply of another type: a text, with ``format="binary"`` bytes."""
    described = {"description": description} if description else {}
    return {**described, "content": {media_type: {"schema": {"type": "string", **schema}}}}


PROBLEM_STATUSES = {
    400: "The body is not JSON.",
    408: "The body did not arrive in time.",
    413: "The body is too large.",
    415: "The body's content type is not JSON.",
    401: "The token is missing or wrong.",
    403: "The token's role may not do this, or a page of another site asks.",
    404: "No such search, saved map, object or place.",
    409: "Another search is under way (`search_id` names it), the map is empty, or it belongs to "
    "another encoder.",
    421: "The gateway does not answer to this host name.",
    422: "The request cannot be understood, the map does not know a place (`places` are those that "
    "it knows), or the encoder does not know a word (`words`, each with its nearest known ones).",
    500: "The gateway failed; its log says why.",
    501: "The gateway was installed without this part.",
    502: "A service failed; `service` names it.",
    503: "A service is missing or does not answer; `service` names it.",
    507: "The mapper cannot write or delete the file.",
}
