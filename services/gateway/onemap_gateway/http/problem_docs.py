"""What is said of services, streams and errors over HTTP, with examples for the documentation."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class ServiceReport(BaseModel):
    """One service, or the robot, as seen from the gateway."""

    name: str
    condition: str = Field(description="ok, degraded or down.")
    problem: str = Field(description="One sentence; empty when all is well.")
    alive: bool = Field(description="Its process is connected now; for the robot: it sends.")
    ready: bool
    heartbeat_age_s: float | None
    metrics: dict[str, float | None]


class StreamReport(BaseModel):
    """One stream of messages as it reaches the gateway."""

    name: str
    age_s: float | None = Field(description="Since the last message; null: none yet.")
    rate_hz: float
    received: int
    missed: int = Field(description="Gaps in the sequence numbers; a slow stage skips.")
    skipped: int = Field(description="Replaced by a newer one before the gateway looked.")
    refused: int = Field(description="Could not be decoded.")
    last_problem: str = Field(description="Why the last one was refused.")


class StatusReport(BaseModel):
    """All that runs, and how."""

    ready: bool = Field(description="As /readyz.")
    problem: str = Field(description="The reason why not.")
    services: list[ServiceReport]
    streams: list[StreamReport]


class HealthReply(BaseModel):
    """The gateway's process lives, or the whole robot is ready."""

    status: str = Field(examples=["ok"])


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
    """OpenAPI entries of the problems an operation may answer with."""
    schema = {"$ref": "#/components/schemas/ProblemDetails"}
    return {
        status: {
            "description": PROBLEM_STATUSES[status],
            "content": {"application/problem+json": {"schema": schema}},
        }
        for status in statuses
    }


BODY = (400, 413, 415)  # of every request with a body

PROBLEM_STATUSES = {
    400: "The body is not JSON.",
    413: "The body is too large.",
    415: "The body's content type is not JSON.",
    401: "The token is missing or wrong.",
    404: "No such search, or no such map file.",
    409: "Another search is under way (`search_id` names it), the map is empty, or it belongs to "
    "another encoder.",
    422: "The request cannot be understood, or the encoder does not know a word "
    "(`words` names each, with the known ones nearest to it).",
    503: "A service is missing or does not answer; `service` names it.",
    507: "The mapper cannot write the file.",
}
