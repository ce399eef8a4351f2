"""The tools of agents: the Model Context Protocol."""
# Talks: imports the protocol's SDK in a thread.

from __future__ import annotations

from typing import Any

from anyio import to_thread
from fastapi import APIRouter, Request, Response
from pydantic import TypeAdapter

from onemap_gateway.http.context import GatewayContext, GatewayDep
from onemap_gateway.http.problems import HttpProblem, problem_responses
from onemap_gateway.http.security import ROLE

ANY_JSON: TypeAdapter[Any] = TypeAdapter(Any)
WANTED = (
    'send one JSON-RPC request to /mcp, such as {"jsonrpc": "2.0", "id": 1, "method": "tools/list"}'
)


def check_message(body: bytes) -> None:
    """HttpProblem unless the body is one JSON-RPC request or notification."""
    try:
        message = ANY_JSON.validate_json(body)
    except ValueError as problem:
        raise HttpProblem("not_json", f"The body is not valid JSON; {WANTED}.") from problem
    if fault := _fault(message):
        raise HttpProblem("invalid", f"{fault}; {WANTED}.", 400)


def _fault(message: Any) -> str:
    """What is wrong with a JSON value as a message; empty if nothing is."""
    if not isinstance(message, dict):
        return "The body holds no JSON object, or several: one message is one object"
    identity = message.get("id", 0)  # a notification has none
    known = isinstance(identity, (int, str)) and not isinstance(identity, bool)
    for holds, wanted in (
        (message.get("jsonrpc") == "2.0", "'jsonrpc' must be \"2.0\""),
        (isinstance(message.get("method"), str), "'method' must name what is asked for"),
        (known, "'id' must be a whole number or a text"),
        (isinstance(message.get("params", {}), dict), "'params' must be a JSON object"),
    ):
        if not holds:
            return wanted
    return ""


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
        **problem_responses(400, 401, 501),
    },
)
async def serve_agent(gateway: GatewayDep, request: Request) -> Response:
    """The Model Context Protocol over streamable HTTP, stateless, for agents and assistants.

    The tools are `where_is`, `list_objects`, `describe_map`, `look_at`, `search_status`, and,
    with a token that may search, `start_search` and `stop`.
    """
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if media_type != "application/json":  # the SDK's answer to an empty body is no problem document
        raise HttpProblem(
            "content_type",
            "Send a message of the Model Context Protocol with the header 'Content-Type: "
            "application/json'.",
        )
    body = await request.body()
    check_message(body)
    try:  # in a thread: the first import of the SDK takes a second
        return await to_thread.run_sync(_response, gateway, request, body)
    except ModuleNotFoundError as missing:
        raise HttpProblem(
            "not_installed",
            f"The tools for agents are not installed ({missing}): 'pip install onemap[mcp]' "
            "where the gateway runs, then start it again.",
        ) from None


def _response(gateway: GatewayContext, request: Request, body: bytes) -> Response:
    from onemap_gateway.http.mcp_server import McpResponse

    return McpResponse(gateway, request.scope[ROLE], body)
