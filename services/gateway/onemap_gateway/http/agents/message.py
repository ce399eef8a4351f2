"""Whether a body is a message of the Model Context Protocol, before the SDK reads it.

What the SDK says of one that is not is a list of its types.
"""

from __future__ import annotations

from typing import Any

from pydantic import TypeAdapter

from onemap_gateway.http.problems import HttpProblem

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
