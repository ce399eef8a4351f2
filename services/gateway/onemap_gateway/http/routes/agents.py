"""The tools of agents: the Model Context Protocol."""
# Talks: imports the protocol's SDK in a thread.

from __future__ import annotations

from importlib import import_module

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, Request, Response

from onemap_gateway.http.context import GatewayDep
from onemap_gateway.http.problems import HttpProblem, problem_responses
from onemap_gateway.http.security import ROLE

TOOLS = "onemap_gateway.http.agent_tools"
IMPORTS = CapacityLimiter(1)  # apart from the threads that requests share: a stop may be one
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
        400: {"description": "No such message; the body is an error of JSON-RPC."},
        406: {"description": "The client does not accept application/json."},
        **problem_responses(501),
    },
)
async def serve_agent(gateway: GatewayDep, request: Request) -> Response:
    """The Model Context Protocol over streamable HTTP, stateless, for agents and assistants.

    The tools are `where_is`, `list_objects`, `list_places`, `describe_map`, `look_at`,
    `search_status`, and, with a token that may search, `start_search` and `stop`.
    """
    body = await request.body()
    try:
        # Always in a thread: the first import takes a second, and others wait for its end there.
        tools = await to_thread.run_sync(import_module, TOOLS, limiter=IMPORTS)
    except ModuleNotFoundError as missing:
        raise HttpProblem(
            "not_installed",
            f"The tools for agents are not installed ({missing}): pip install -e '.[mcp]' "
            "where the gateway runs, then start it again.",
        ) from None
    response: Response = tools.McpResponse(gateway, request.scope[ROLE], body)
    return response
