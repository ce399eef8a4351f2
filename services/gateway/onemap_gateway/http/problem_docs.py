"""Problems as the OpenAPI document describes them."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from pydantic import BaseModel, ConfigDict

from onemap_gateway.config import Role
from onemap_gateway.http.access import READING, required_role


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
                    "detail": "The mapper is not running: start it with 'onemap mapper', "
                    "or see 'onemap status'.",
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


def common_statuses(method: str, path: str, documented: Collection[str]) -> list[int]:
    """Statuses of this operation besides the ``documented`` ones of its own route.

    They come from the checks before the route and from failures behind it.
    """
    found = [421, 500]
    if required_role(method, path) is not Role.NOBODY:
        found += [401, 403, 429]
    if method not in READING:
        found += [403, 408, 413, 415]
    if "503" in documented:
        found += [502]
    return sorted({status for status in found if str(status) not in documented})


BODY = (400, 413, 415)  # of every request with a body

PROBLEM_STATUSES = {
    400: "The body is not JSON.",
    408: "The body did not arrive in time.",
    413: "The body is too large.",
    415: "The body's content type is not JSON.",
    401: "The token is missing or wrong.",
    403: "The token's role may not do this, or a page of another site asks.",
    404: "No such search, saved map or object.",
    409: "Another search is under way (`search_id` names it), the map is empty, or it belongs to "
    "another encoder.",
    421: "The gateway does not answer to this host name.",
    422: "The request cannot be understood, or the encoder does not know a word "
    "(`words` names each, with the known ones nearest to it).",
    429: "There were too many wrong tokens from this address.",
    500: "The gateway failed; its log says why.",
    501: "The gateway was installed without this part.",
    502: "A service failed; `service` names it.",
    503: "A service is missing or does not answer; `service` names it.",
    507: "The mapper cannot write or delete the file.",
}
