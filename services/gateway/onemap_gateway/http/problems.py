"""Errors as people and programs can use them: RFC 9457 problem details.

Each kind has a status and a title that never change; ``detail`` is one sentence that
tells what to do. The codes with which services refuse a request are kinds, too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from onemap_shared.transport import CallError, NoReply, QueryTimeout, RemoteError

MEDIA_TYPE = "application/problem+json"
RETRY_AFTER_S = 2  # a killed service is back in about this time


@dataclass(frozen=True, slots=True)
class Kind:
    """What all problems of one kind share."""

    status: int
    title: str


KINDS: Mapping[str, Kind] = {
    "not_json": Kind(400, "The body is not JSON"),
    "unauthorized": Kind(401, "A token is needed"),
    "foreign_origin": Kind(403, "The request comes from another site's page"),
    "not_found": Kind(404, "There is no such thing here"),
    "unknown_search": Kind(404, "There is no such search"),
    "unknown_map": Kind(404, "There is no such map"),
    "method_not_allowed": Kind(405, "This address does not take this method"),
    "slow_body": Kind(408, "The body did not arrive in time"),
    "conflict": Kind(409, "Another search is under way"),
    "empty_map": Kind(409, "The map is empty"),
    "encoder_mismatch": Kind(409, "The map was made with another encoder"),
    "too_large": Kind(413, "The body is too large"),
    "content_type": Kind(415, "The body must be JSON"),
    "misdirected": Kind(421, "This host name is not served"),
    "invalid": Kind(422, "The request cannot be understood"),
    "unknown_word": Kind(422, "The encoder does not know this word"),
    "http": Kind(400, "The request was refused"),
    "internal": Kind(500, "The gateway failed"),
    "remote": Kind(502, "A service failed"),
    "unavailable": Kind(503, "A service is missing"),
    "timeout": Kind(503, "A service does not answer"),
    "busy": Kind(503, "A service is busy"),
    "not_ready": Kind(503, "The robot's map is not being updated"),
    "storage": Kind(507, "A file cannot be written"),
}

# Refusals of a service that itself waits for another one: the kind, and who is missing.
BEHIND = {
    "perception_missing": ("unavailable", "perception"),
    "perception_silent": ("timeout", "perception"),
}

# Members of the document, and of ``Problem``, that the details of a service may not replace.
OWN_MEMBERS = frozenset({"type", "title", "status", "detail", "service", "kind", "self"})

START = "start it with 'onemap {service}', or see 'onemap status'"


class Problem(Exception):
    """A request that cannot be served, and why; becomes the HTTP response."""

    def __init__(self, kind: str, detail: str, status: int | None = None, **extra: Any) -> None:
        super().__init__(detail)
        self.kind = kind
        self.status = status or KINDS[kind].status
        self.detail = detail
        self.extra = extra

    @property
    def document(self) -> dict[str, Any]:
        """The problem details object."""
        return {
            "type": f"/docs#problem-{self.kind}",
            "title": KINDS[self.kind].title,
            "status": self.status,
            "detail": self.detail,
            **self.extra,
        }

    @property
    def headers(self) -> dict[str, str]:
        """What HTTP wants beside the document."""
        if self.status == 503:
            return {"Retry-After": str(RETRY_AFTER_S)}
        if self.status == 401:
            return {"WWW-Authenticate": "Bearer"}
        return {}


def never_hung(_service: str) -> str:
    """Where nobody knows whether a service hangs."""
    return ""


def from_call(
    error: CallError, service: str, timeout_s: float, hung: Callable[[str], str] = never_hung
) -> Problem:
    """The problem behind a question to ``service`` that got no answer.

    ``hung`` says of a service that it hangs, in a sentence, or nothing: the bus cannot tell a
    process that hangs from one that ended, since both lose their connection.
    """
    silent = _silent(error, service)
    if silent and (detail := hung(silent)):
        return Problem("timeout", detail, service=silent)
    match error:
        case NoReply():
            detail = f"{called(service)} is not running: {START.format(service=service)}."
            return Problem("unavailable", detail, service=service)
        case QueryTimeout():
            detail = (
                f"{called(service)} did not answer within {timeout_s:g} s: try again; if it "
                "goes on, 'onemap doctor' says why."
            )
            return Problem("timeout", detail, service=service)
        case RemoteError(code=code) if code in BEHIND:
            kind, missing = BEHIND[code]
            return Problem(kind, sentence(str(error)), service=missing)
        case RemoteError(code=code) if code in KINDS and KINDS[code].status != 500:
            details = {k: v for k, v in error.details.items() if k not in OWN_MEMBERS}
            return Problem(code, sentence(str(error)), service=service, **details)
        case _:
            detail = f"{called(service)} failed: {sentence(str(error))}"
            return Problem("remote", detail, service=service)


def _silent(error: CallError, asked: str) -> str:
    """The service that gave no sign, empty if all did."""
    if isinstance(error, RemoteError):
        return BEHIND[error.code][1] if error.code in BEHIND else ""
    return asked


def called(service: str) -> str:
    """The service as the start of a sentence."""
    return "Perception" if service == "perception" else f"The {service}"


def from_validation(errors: Sequence[Mapping[str, Any]]) -> Problem:
    """The problem of a request that does not fit its schema; names every field that is wrong.

    The offending values are not repeated: they may be huge, or not even valid text.
    """
    if any(error["type"] == "json_invalid" for error in errors):
        return Problem("not_json", "The body is not valid JSON: check quotes, commas and braces.")
    fields = [{"field": _place(error), "reason": _reason(error)} for error in errors]
    return Problem("invalid", sentence("; ".join(f["reason"] for f in fields)), errors=fields)


def _place(error: Mapping[str, Any]) -> str:
    # The first part says body, path or query: the reader sees that from the name.
    return ".".join(str(part) for part in error["loc"][1:])


def _reason(error: Mapping[str, Any]) -> str:
    place = _place(error)
    match error["type"]:
        case "extra_forbidden":
            return f"{place!r} is no field of this request: remove it or correct its name"
        case "missing":
            return f"{place!r} is missing" if place else "this request needs a JSON body"
        case "value_error":  # the schema's own sentence
            return str(error["msg"]).removeprefix("Value error, ")
        case _:
            reason = str(error["msg"])
            return f"{place!r}: {reason[0].lower()}{reason[1:]}" if place else reason


def sentence(text: str) -> str:
    """The text with a capital letter and a full stop."""
    text = " ".join(text.split())
    if not text:
        return "No reason was given."
    return text[0].upper() + text[1:] + ("" if text[-1] in ".!?" else ".")
