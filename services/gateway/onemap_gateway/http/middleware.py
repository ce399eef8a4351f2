"""Around every route: headers, counts, several robots behind one gateway."""
# Talks: logs requests, and ends an answer after its headers.

from __future__ import annotations

import logging
from collections.abc import Mapping

import anyio
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from onemap_gateway.http.problems import HttpProblem, problem_response
from onemap_gateway.http.security import only_looks
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
            route = getattr(scope.get("route"), "path_format", "other")
            self._requests.count(_known_method(scope["method"]), route, status)


def _known_method(method: str) -> str:
    """The method, or "other": each method that a client invents would be a new time series."""
    return method if method in {"GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS"} else "other"


class DepartureMiddleware:
    """Ends the work for a request that changes nothing when its client has gone.

    Otherwise clients that give up and ask again would wait behind the work for those who gave up.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The ASGI interface."""
        if scope["type"] != "http" or not only_looks(scope["method"], scope["path"]):
            await self._app(scope, receive, send)
            return
        unread, left = [await receive()], anyio.Event()  # a body was read before, and is whole

        async def watch() -> None:
            while (await receive())["type"] != "http.disconnect":
                pass
            left.set()
            tasks.cancel_scope.cancel()

        async def receive_again() -> Message:
            if not unread:
                await left.wait()
            return unread.pop() if unread else {"type": "http.disconnect"}

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(watch)
            await self._app(scope, receive_again, send)
            tasks.cancel_scope.cancel()


FOLDER = "/robots/"


class FleetApp:
    """Chooses the application by the path, which that application then sees without the prefix.

    So every check, route and document is that of a gateway with one robot. Anything else is the
    business of ``own``, names that no robot has included.
    """

    def __init__(self, own: ASGIApp, robots: Mapping[str, ASGIApp]) -> None:
        self._own, self._robots = own, robots

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The ASGI interface."""
        name, rest = split(scope.get("path", ""))
        app = self._robots.get(name)
        if app is None:
            await self._own(scope, receive, send)
            return
        inner = {**scope, "path": rest, "raw_path": rest.encode()}
        await app(inner, receive, _with_prefix(send, FOLDER + name))


def split(path: str) -> tuple[str, str]:
    """The robot's name in a path, empty if there is none, and what follows it, at least "/"."""
    if not path.startswith(FOLDER):
        return "", path
    name, _, rest = path.removeprefix(FOLDER).partition("/")
    return name, f"/{rest}"


def _with_prefix(send: Send, prefix: str) -> Send:
    """Puts the robot's prefix before the address of what a request made."""

    async def prefixed(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            location = headers.get("location", "")
            if location.startswith("/"):
                headers["location"] = prefix + location
        await send(message)

    return prefixed
