"""Which requests stop the robot. They have a way of their own, which nothing else can use up."""

from __future__ import annotations

from pydantic import BaseModel, ValidationError
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from onemap_gateway.http.middleware import split
from onemap_gateway.http.problems import HttpProblem, problem_response
from onemap_gateway.http.security import MAX_BODY_BYTES, buffered_body, replayed


def is_stop(method: str, path: str) -> bool:
    """Whether a request ends a search by its address alone."""
    return method == "DELETE" and split(path)[1].rpartition("/")[0] == "/v1/searches"


class _Tool(BaseModel):
    name: str


class _ToolCall(BaseModel):
    params: _Tool


class StopsOnly:
    """Passes on requests that stop the robot, and answers all others with a problem.

    limit: of connections; ``stopping``: while a request is passed on.
    """

    def __init__(self, app: ASGIApp, limit: int) -> None:
        self._app, self._limit = app, limit
        self.stopping = False

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The ASGI interface."""
        stop = await _stop_request(scope, receive)
        if stop is None:
            busy = HttpProblem(
                "busy",
                f"The gateway serves {self._limit} connections at once and has no room for "
                "another, except to stop the robot: try again.",
                service="gateway",
            )
            response = problem_response(busy)
            response.headers["Connection"] = "close"
            await response(scope, receive, send)
            return
        self.stopping = True
        try:
            await self._app(scope, stop, send)
        finally:
            self.stopping = False


async def _stop_request(scope: Scope, receive: Receive) -> Receive | None:
    """What yields the body of a request that stops the robot; None of any other request."""
    if is_stop(scope["method"], scope["path"]):
        return receive
    if (scope["method"], split(scope["path"])[1]) != ("POST", "/mcp"):
        return None
    try:
        body = await buffered_body(Headers(scope=scope), receive, MAX_BODY_BYTES)
        call = _ToolCall.model_validate_json(body)
    except (HttpProblem, ValidationError):
        return None
    return replayed(body, receive) if call.params.name == "stop" else None
