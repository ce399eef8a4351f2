"""HEAD and OPTIONS, for every address."""
# Talks: ends an answer after its headers.

from __future__ import annotations

import anyio
from starlette.responses import Response
from starlette.routing import BaseRoute, Match, Mount
from starlette.types import ASGIApp, Message, Receive, Scope, Send

METHODS = ("GET", "POST", "PUT", "DELETE")


class MethodMiddleware:
    """Answers HEAD with the headers of GET, and OPTIONS with the methods of the address."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The ASGI interface."""
        method = scope.get("method")
        if method == "HEAD":
            await self._send_head(scope, receive, send)
        elif method == "OPTIONS" and (allowed := allowed_methods(scope)):
            answer = Response(status_code=204, headers={"Allow": ", ".join(allowed)})
            await answer(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    async def _send_head(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run GET up to its headers; a stream of events would otherwise never end."""
        get = {**scope, "method": "GET"}  # a copy: the server reads the method of its own

        async def send_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                await send(message)
                await send({"type": "http.response.body", "body": b""})
                running.cancel()  # takes effect when the route waits; until then it is not heard

        with anyio.CancelScope() as running:
            await self._app(get, receive, send_headers)
        if "route" in get:  # what counts requests reads it
            scope["route"] = get["route"]


def allowed_methods(scope: Scope) -> list[str]:
    """The methods that the address of a request takes; empty if there is nothing at it."""
    # A mounted folder of files has its own root path: begin at the application's.
    address = {**scope, "root_path": scope.get("app_root_path", scope.get("root_path", ""))}
    routes: list[BaseRoute] = scope["app"].routes
    taken = [
        method
        for method in METHODS
        if any(_takes(route, {**address, "method": method}) for route in routes)
    ]
    if "GET" in taken:
        taken.insert(1, "HEAD")
    return [*taken, "OPTIONS"] if taken else []


def _takes(route: BaseRoute, scope: Scope) -> bool:
    match, _ = route.matches(scope)
    files_only = isinstance(route, Mount) and scope["method"] != "GET"
    return match is Match.FULL and not files_only
