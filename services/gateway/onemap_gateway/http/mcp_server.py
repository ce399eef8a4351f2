"""The Model Context Protocol over streamable HTTP, with its official SDK.

Stateless: each request is complete in itself, so that a gateway that was restarted answers the
same agent without a new handshake, and nothing has to be remembered of agents that went away.
"""
# Talks: logs what agents did.

from __future__ import annotations

import base64
import logging
from typing import Any

from mcp import types
from mcp.server.context import ServerRequestContext
from mcp.server.lowlevel import Server
from mcp.server.streamable_http_manager import StreamableHTTPSessionManager
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from onemap_gateway.config import GatewayConfig, Role
from onemap_gateway.http.agent_tools import TOOLS, AgentTool, ToolResult, budget_limits, call_tool
from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.problems import HttpProblem
from onemap_gateway.http.reply_docs import complete
from onemap_gateway.http.security import replayed
from onemap_gateway.present.formats import finite, json_text

LOG = logging.getLogger("onemap.gateway")
logging.getLogger("mcp").setLevel(logging.WARNING)  # it reports the start and end of each request

INSTRUCTIONS = (
    "A robot that knows where things are. Ask 'where_is' and 'list_objects' first. Only "
    "'start_search' moves the robot: give it a budget, tell people before you use it, and follow "
    "it with 'search_status'. Places are x, y in metres of the map frame."
)


class McpResponse(Response):
    """Answers one request of an agent whose token has ``role``; its body has been read."""

    def __init__(self, gateway: GatewayContext, role: Role, message: bytes) -> None:
        super().__init__()
        self._gateway = gateway
        self._role = role
        self._message = message

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The ASGI interface."""
        server = Server(
            "onemap",
            title="OneMap",
            instructions=INSTRUCTIONS,
            on_list_tools=self._list_tools,
            on_call_tool=self._call_tool,
        )
        manager = StreamableHTTPSessionManager(server, json_response=True, stateless=True)
        async with manager.run():
            await manager.handle_request(scope, replayed(self._message, receive), send)

    async def _list_tools(
        self, _context: ServerRequestContext[Any], _params: types.PaginatedRequestParams | None
    ) -> types.ListToolsResult:
        tools = [described(tool, self._gateway.config) for tool in TOOLS.values()]
        return types.ListToolsResult(tools=tools)

    async def _call_tool(
        self, _context: ServerRequestContext[Any], params: types.CallToolRequestParams
    ) -> types.CallToolResult:
        try:
            result = await call_tool(self._gateway, self._role, params.name, params.arguments or {})
        except HttpProblem as problem:
            refusal = types.TextContent(type="text", text=problem.detail)
            return types.CallToolResult(content=[refusal], is_error=True)
        if TOOLS[params.name].changes:
            LOG.info("an agent: %s", result.reply.summary)
        return tool_result(result)


def described(tool: AgentTool, config: GatewayConfig) -> types.Tool:
    """A tool as agents see it, with the limits of this gateway in its schema."""
    takes = tool.arguments.model_json_schema()
    for name, limit, _unit in budget_limits(config):
        if name in takes.get("properties", {}):
            takes["properties"][name]["maximum"] = limit
    gives = tool.reply.model_json_schema(mode="serialization")
    complete(gives.get("$defs", {}))
    return types.Tool(
        name=tool.name,
        description=tool.description,
        input_schema=takes,
        output_schema=gives,
        annotations=types.ToolAnnotations(
            read_only_hint=not tool.changes, destructive_hint=False, open_world_hint=False
        ),
    )


def tool_result(result: ToolResult) -> types.CallToolResult:
    """The summary, the document as text for agents that read no structures, and the picture."""
    document = finite(result.reply.model_dump(mode="json"))
    content: list[types.ContentBlock] = [
        types.TextContent(type="text", text=result.reply.summary),
        types.TextContent(type="text", text=json_text(document)),
    ]
    if result.picture:
        data = base64.b64encode(result.picture).decode("ascii")
        content.append(types.ImageContent(type="image", data=data, mime_type=result.media_type))
    return types.CallToolResult(content=content, structured_content=document)
