"""The tools of agents: the Model Context Protocol."""
# Talks: imports the protocol's SDK in a thread.

from __future__ import annotations

from anyio import to_thread
from fastapi import APIRouter, Request, Response

from onemap_gateway.http.agents.message import check_message
from onemap_gateway.http.context import GatewayContext, GatewayDep
from onemap_gateway.http.problem_docs import problem_responses
from onemap_gateway.http.problems import HttpProblem
from onemap_gateway.http.security import ROLE

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
    from onemap_gateway.http.agents.server import McpResponse

    return McpResponse(gateway, request.scope[ROLE], body)
