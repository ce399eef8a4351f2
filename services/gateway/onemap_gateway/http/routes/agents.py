"""The tools of agents: the Model Context Protocol."""
# Talks: imports the protocol's SDK in a thread.

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any, Literal

from anyio import to_thread
from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, StrictInt, StrictStr, ValidationError

from onemap_gateway.http.context import GatewayContext, GatewayDep
from onemap_gateway.http.problems import HttpProblem, from_validation_error, problem_responses
from onemap_gateway.http.security import JSON, ROLE, media_type

SDK_USER = "onemap_gateway.http.mcp_server"
WANTED = (
    'send one JSON-RPC request to /mcp, such as {"jsonrpc": "2.0", "id": 1, "method": "tools/list"}'
)


class JsonRpcMessage(BaseModel):
    """One request or notification, as far as it is checked before the SDK reads it."""

    jsonrpc: Literal["2.0"]
    method: str
    id: StrictInt | StrictStr = 0  # a notification has none
    params: dict[str, Any] = {}


def check_message(body: bytes) -> None:
    """HttpProblem unless the body is one JSON-RPC request or notification."""
    try:
        JsonRpcMessage.model_validate_json(body)
    except ValidationError as error:
        problem = from_validation_error(error)
        raise HttpProblem(problem.code, f"{problem.detail[:-1]}; {WANTED}.", 400) from None


router = APIRouter(tags=["agents"])


@router.post(
    "/mcp",
    summary="Tools for agents",
    response_class=Response,
    responses={
        200: {
            "description": "A message of the Model Context Protocol.",
            "content": {"application/json": {"schema": {"type": "object"}}},
        },
        406: {"description": "The client does not accept application/json."},
        **problem_responses(400, 501),
    },
)
async def serve_agent(gateway: GatewayDep, request: Request) -> Response:
    """The Model Context Protocol over streamable HTTP, stateless, for agents and assistants.

    The tools are `where_is`, `list_objects`, `describe_map`, `look_at`, `search_status`, and,
    with a token that may search, `start_search` and `stop`.
    """
    if media_type(request.headers) != JSON:  # the SDK's answer to no body is no problem document
        raise HttpProblem(
            "content_type",
            f"Send a message of the Model Context Protocol with the header 'Content-Type: {JSON}'.",
        )
    body = await request.body()
    check_message(body)
    try:
        if SDK_USER not in sys.modules:  # in a thread: the import of the SDK takes a second
            await to_thread.run_sync(import_module, SDK_USER)
        return _response(gateway, request, body)
    except ModuleNotFoundError as missing:
        raise HttpProblem(
            "not_installed",
            f"The tools for agents are not installed ({missing}): pip install -e '.[mcp]' "
            "where the gateway runs, then start it again.",
        ) from None


def _response(gateway: GatewayContext, request: Request, body: bytes) -> Response:
    from onemap_gateway.http.mcp_server import McpResponse

    return McpResponse(gateway, request.scope[ROLE], body)
