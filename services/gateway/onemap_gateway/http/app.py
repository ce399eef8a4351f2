"""The application: routes, errors, documentation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import Response

from onemap_gateway.config import Role
from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.middleware import (
    DepartureMiddleware,
    ResponseMiddleware,
)
from onemap_gateway.http.problems import (
    PROBLEM_TYPES,
    HttpProblem,
    ProblemDetails,
    from_validation_errors,
    problem_response,
    problem_responses,
)
from onemap_gateway.http.routes import agents, map, objects, pages, places, queries, robot, searches
from onemap_gateway.http.security import READING, SecurityMiddleware, required_role

DESCRIPTION = """
Ask a robot where things are, and send it to find them.

Errors are problem details (RFC 9457): `detail` says in a sentence what to do, `service` which
service is missing. All lengths are metres in the map's frame, which is the frame of the robot's
poses (z up, the floor at 0); positions are rounded to millimetres. Times are RFC 3339 in UTC
(`_at`) or nanoseconds since 1970 as a string (`_ns`), most of them both.

`WS /v1/live` sends the whole state, a JSON object, about five times a second: `ready`, `problem`,
`robot`, `map`, `camera`, `search`, `path`, `trail_m`, `services` and `latencies`. The sequence
numbers in it tell a client when to fetch `/v1/map.png`, `/v1/camera.jpg` and `/v1/objects` again.

If the gateway has a token, every request but those for the page, this documentation, `/healthz`
and `/readyz` needs `Authorization: Bearer <token>`.
"""

TAGS = [
    {"name": "queries", "description": "Where is it?"},
    {"name": "searches", "description": "Go and find."},
    {"name": "objects", "description": "What was found, and where."},
    {"name": "places", "description": "Rooms with a name, and zones that no robot enters."},
    {"name": "map", "description": "The map of the floor: image, arrays, numbers."},
    {"name": "maps", "description": "Saved maps."},
    {"name": "camera", "description": "The newest camera image."},
    {"name": "agents", "description": "Tools for assistants: the Model Context Protocol."},
    {"name": "robots", "description": "Several robots behind one gateway."},
    {"name": "health", "description": "What runs, and why not."},
]


def create_app(gateway: GatewayContext) -> FastAPI:
    """The HTTP interface of ``gateway``."""
    app = _Application(
        title="OneMap",
        version="1",
        description=DESCRIPTION,
        openapi_tags=TAGS,
        docs_url=None,  # FastAPI's page loads its scripts from the internet, which robots lack
        redoc_url=None,
        redirect_slashes=False,
    )
    app.state.gateway = gateway
    for router in (
        queries.router,
        searches.router,
        objects.router,
        places.router,
        map.router,
        map.maps_router,
        map.camera_router,
        robot.router,
        robot.robots_router,
        agents.router,
        pages.router,
    ):
        app.include_router(router)
    app.mount("/static/swagger-ui", pages.StaticPages(directory=pages.SWAGGER_UI))
    app.mount("/static", pages.StaticPages(directory=pages.STATIC))
    app.add_exception_handler(HttpProblem, _on_problem)
    app.add_exception_handler(RequestValidationError, _on_validation)
    app.add_exception_handler(HTTPException, _on_http)
    app.add_middleware(DepartureMiddleware)
    app.add_middleware(SecurityMiddleware, config=gateway.config)
    app.add_middleware(ResponseMiddleware, requests=gateway.requests)
    return app


class _Application(FastAPI):
    def openapi(self) -> dict[str, Any]:
        """The OpenAPI document, made on the first request: that takes 0.1 s."""
        if self.openapi_schema is None:
            self.openapi_schema = super().openapi()
            _complete(self.openapi_schema)
        return self.openapi_schema


def _complete(document: dict[str, Any]) -> None:
    """Add the problems, which FastAPI cannot derive from the routes."""
    schemas = document["components"]["schemas"]
    schemas["ProblemDetails"] = ProblemDetails.model_json_schema()
    schemas.pop("HTTPValidationError", None)
    schemas.pop("ValidationError", None)
    events = document["paths"]["/v1/searches/{search_id}/events"]["get"]["responses"]["200"]
    events["content"]["text/event-stream"].pop("itemSchema", None)  # of OpenAPI 3.2; this is 3.1
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            responses = operation["responses"]
            missing = _common_statuses(method.upper(), path, operation)
            responses.update({str(k): v for k, v in problem_responses(*missing).items()})
    document["x-problems"] = {
        code: {"status": status, "title": title} for code, (status, title) in PROBLEM_TYPES.items()
    }


def _common_statuses(method: str, path: str, operation: Mapping[str, Any]) -> list[int]:
    """Statuses of an operation besides those that its own route documents.

    They come from the checks before the route and from failures behind it.
    """
    statuses = {421, 500}
    if required_role(method, path) is not Role.NOBODY:
        statuses |= {401, 403}
    if method not in READING:
        statuses |= {403, 408, 413, 415}
    if "requestBody" in operation:
        statuses |= {400}
    if "503" in operation["responses"]:
        statuses |= {502}
    return sorted(statuses - {int(status) for status in operation["responses"]})


async def _on_problem(_request: Request, problem: Exception) -> Response:
    assert isinstance(problem, HttpProblem)
    return problem_response(problem)


async def _on_validation(_request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    return problem_response(from_validation_errors(error.errors()))


async def _on_http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    path = request.url.path[:100]
    if error.status_code == 404:
        problem = HttpProblem(
            "not_found", f"There is nothing at {path}: /docs lists what there is."
        )
    elif error.status_code == 405:
        detail = f"{path} does not take {request.method[:20]}: /docs lists what it does."
        problem = HttpProblem("method_not_allowed", detail)
    elif error.status_code == 400:  # FastAPI could not read the body
        problem = HttpProblem(
            "not_json",
            "The body cannot be read as JSON: write it in UTF-8, without thousands of nested "
            "brackets or of digits.",
        )
    else:
        problem = HttpProblem("http", str(error.detail), status=error.status_code)
    response = problem_response(problem)
    response.headers.update(error.headers or {})
    return response
