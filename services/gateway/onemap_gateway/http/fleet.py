"""Several robots behind one gateway: /robots/NAME/... is the application of that robot."""

from __future__ import annotations

from collections.abc import Mapping

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

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
