"""Outermost middleware: security headers, request counts, a response when a route fails."""
# Talks: logs and times requests.

from __future__ import annotations

import logging

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from onemap_gateway.http.problems import HttpProblem, problem_response
from onemap_gateway.present.metrics import RequestCounter

LOG = logging.getLogger("onemap.gateway")

# Nothing is loaded from other sites, and no site may frame the page and cover its stop button.
HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Content-Security-Policy": "default-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self' ws: wss:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
}


class ResponseMiddleware:
    """Completes every HTTP response and counts it."""

    def __init__(self, app: ASGIApp, requests: RequestCounter) -> None:
        self._app = app
        self._requests = requests

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The ASGI interface."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        status = 0

        async def send_with_headers(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
                # the robot's state changes with every request: no cache may keep it
                headers.setdefault("Cache-Control", "no-store")
            await send(message)

        try:
            await self._app(scope, receive, send_with_headers)
        except Exception:
            LOG.exception("%s %s failed", scope["method"], scope["path"])
            if status:  # the response has begun: only closing the connection can tell the client
                raise
            failure = HttpProblem(
                "internal", "The gateway failed on this request; its log says why."
            )
            await problem_response(failure)(scope, receive, send_with_headers)
        finally:
            route = getattr(scope.get("route"), "path", "other")
            self._requests.count(_known_method(scope["method"]), route, status)


def _known_method(method: str) -> str:
    """The method, or "other": each method that a client invents would be a new time series."""
    return method if method in {"GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS"} else "other"
