"""Who may send which request, and the checks of host, origin, role and body before any route.

A browser lets every page of the web send requests to this machine. The headers ``Host`` and
``Origin`` tell those requests from the ones of the gateway's own page (DNS rebinding, CSRF).
"""
# Talks: reads a request's body, waits after a wrong token, and logs it.

from __future__ import annotations

import logging
import math
from base64 import urlsafe_b64decode
from hashlib import sha256
from ipaddress import ip_address
from urllib.parse import urlsplit

import anyio
from starlette.datastructures import Headers
from starlette.requests import ClientDisconnect, Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from onemap_gateway.config import TOKENS, GatewayConfig, Role
from onemap_gateway.http.problems import HttpProblem, problem_response
from onemap_shared.messages import MAX_IMAGE_BYTES

# The page and its documentation are the same for every robot, the two checks say only whether
# and which stage works. Everything else shows or changes this robot.
PUBLIC_PATHS = frozenset({"/", "/docs", "/openapi.json", "/favicon.ico", "/healthz", "/readyz"})
PUBLIC_FOLDER = "/static/"
READING = frozenset({"GET", "HEAD", "OPTIONS"})
# Requests that change nothing by themselves. Each tool of an agent checks the role it needs.
LOOKING = frozenset(("POST", path) for path in ("/v1/queries", "/v1/map.png"))
AGENTS = ("POST", "/mcp")

WRONG_TOKEN_S = 1.0  # until it is answered: pages with an old token ask again and again
LOG_PERIOD_S = 60.0  # at most one line about wrong tokens within it


def required_role(method: str, path: str) -> Role:
    """The least role that may send this request; changes without a rule need the highest."""
    if method in READING:
        public = path in PUBLIC_PATHS or path.startswith(PUBLIC_FOLDER)
        return Role.NOBODY if public else Role.LOOK
    if only_looks(method, path) or (method, path) == AGENTS:
        return Role.LOOK
    folder, _, name = path.rpartition("/")
    starts = path == "/v1/searches" or (path.startswith("/v1/searches/") and name == "again")
    ends = folder == "/v1/searches" and name
    if (method == "POST" and starts) or (method == "DELETE" and ends):
        return Role.SEARCH
    return Role.ADMINISTER


def only_looks(method: str, path: str) -> bool:
    """Whether a request changes nothing, whatever its body says."""
    return method in READING or (method, path) in LOOKING


MAX_BODY_BYTES = 64 * 1024
# Behind the prefix of any robot: the body of these may hold an image in base64.
LARGE_PATHS = ("/v1/queries", "/v1/map.png")
MAX_IMAGE_BODY_BYTES = MAX_BODY_BYTES + (MAX_IMAGE_BYTES * 4 + 2) // 3
BODY_TIMEOUT_S = 10.0  # for 64 kB over a link of 6.5 kB/s, and for an image over 77 kB/s
# A browser cannot add a header to a WebSocket, so the page sends its token, in base64url without
# padding, as one of the subprotocols; the gateway chooses LIVE_PROTOCOL, never the token.
TOKEN_PROTOCOL = "onemap.token."
LIVE_PROTOCOL = "onemap.live"
JSON = "application/json"
ROLE = "onemap.role"  # member of the scope: the role of the client, for routes that ask for it
LOG = logging.getLogger("onemap.gateway")


class SecurityMiddleware:
    """Refuses requests by host, origin, role, and by size, type and duration of the body."""

    def __init__(self, app: ASGIApp, config: GatewayConfig) -> None:
        self._app = app
        self._wrong, self._logged_s = 0, -math.inf  # tokens since the last line about them
        self._hosts = frozenset(name.lower() for name in config.allowed_hosts)
        # by digest: how long a look-up takes tells nothing of a token
        self._roles = {_digest(t.encode()): role for role, t in config.tokens().items() if t}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The ASGI interface."""
        headers = Headers(scope=scope)
        try:
            self._check_host(headers)
            method = "GET" if scope["type"] == "websocket" else scope["method"]
            if scope["type"] == "websocket" or method not in READING:
                self._check_origin(headers)
            scope[ROLE] = Role.ADMINISTER
            if self._roles:  # without any, everybody may do everything
                required = required_role(method, scope["path"])
                scope[ROLE] = await self._check_role(required, scope, headers)
            if method not in READING:
                large = scope["path"].endswith(LARGE_PATHS)
                limit = MAX_IMAGE_BODY_BYTES if large else MAX_BODY_BYTES
                receive = replayed(await buffered_body(headers, receive, limit), receive)
        except HttpProblem as problem:
            if scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": 1008, "reason": ""})
            else:
                await problem_response(problem)(scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _check_host(self, headers: Headers) -> None:
        name = _host_name(headers.get("host", ""))
        if name in self._hosts or name == "localhost" or _is_address(name):
            return
        raise HttpProblem(
            "misdirected",
            f"The gateway does not answer to the name {name[:100]!r}: use its IP address, or add "
            "the name to 'gateway.allowed_hosts'.",
        )

    def _check_origin(self, headers: Headers) -> None:
        origin = headers.get("origin")
        if origin is None:  # not a browser
            return
        site = origin.partition("://")[2]
        own = site and site == headers.get("host")
        if own or _host_name(site) in self._hosts:  # a proxy may rename
            return
        raise HttpProblem(
            "foreign_origin",
            f"A page from {origin[:100]} may not use the robot: open the gateway's own page.",
        )

    async def _check_role(self, required: Role, scope: Scope, headers: Headers) -> Role:
        """The role of the client, at least ``required``; raises HttpProblem if it is lower."""
        token = presented_token(headers)
        if required is Role.NOBODY:
            return required
        if token is None:
            raise HttpProblem(
                "unauthorized",
                "Send the header 'Authorization: Bearer <token>' with a token of the "
                "configuration ('gateway.token').",
            )
        role = self._roles.get(_digest(token), Role.NOBODY)
        if role is Role.NOBODY:
            self._log_wrong((scope.get("client") or ("", 0))[0], anyio.current_time())
            await anyio.sleep(WRONG_TOKEN_S)
            raise HttpProblem(
                "unauthorized",
                "The token is not one of the configuration ('gateway.token'): correct it.",
            )
        if role < required:
            raise HttpProblem(
                "forbidden",
                f"This token may not do that: use that of 'gateway.{TOKENS[required]}' or of a "
                "higher role.",
            )
        return role

    def _log_wrong(self, address: str, now_s: float) -> None:
        self._wrong += 1
        if now_s - self._logged_s >= LOG_PERIOD_S:
            LOG.warning("wrong tokens: %d, the last from %s", self._wrong, address)
            self._wrong, self._logged_s = 0, now_s


def _digest(token: bytes) -> bytes:
    return sha256(token).digest()


def presented_token(headers: Headers) -> bytes | None:
    """The token of a request, byte for byte; None if it has none."""
    scheme, _, given = headers.get("authorization", "").partition(" ")
    if scheme.lower() == "bearer":
        return given.strip().encode("latin-1")  # as the server decoded the header
    for offered in headers.get("sec-websocket-protocol", "").split(","):
        if (name := offered.strip()).startswith(TOKEN_PROTOCOL):
            encoded = name.removeprefix(TOKEN_PROTOCOL)
            try:
                return urlsafe_b64decode(encoded + "=" * (-len(encoded) % 4))
            except ValueError:
                return b""
    return None


def _host_name(netloc: str) -> str:
    """The host name without port and brackets, lower case; empty if there is none."""
    try:
        return urlsplit(f"//{netloc}").hostname or ""
    except ValueError:
        return ""


def _is_address(name: str) -> bool:
    try:
        ip_address(name)
    except ValueError:
        return False
    return True


async def buffered_body(headers: Headers, receive: Receive, limit_bytes: int) -> bytes:
    """Read the body within its limits; raises HttpProblem."""
    length = headers.get("content-length", "0")
    if not length.isdecimal() or int(length[:20]) > limit_bytes:
        raise _too_large(limit_bytes)
    body = b""
    try:
        with anyio.fail_after(BODY_TIMEOUT_S):
            async for part in Request({"type": "http"}, receive).stream():
                body += part
                if len(body) > limit_bytes:
                    raise _too_large(limit_bytes)
    except TimeoutError:
        raise HttpProblem(
            "slow_body", f"The body did not arrive within {BODY_TIMEOUT_S:g} s: send it in one go."
        ) from None
    except ClientDisconnect:
        raise HttpProblem(
            "slow_body", "The connection ended before the body was complete."
        ) from None
    if body and media_type(headers) != JSON:
        raise HttpProblem(
            "content_type",
            f"Send JSON with the header 'Content-Type: {JSON}'; /docs has an example for each "
            "request.",
        )
    return body


def media_type(headers: Headers) -> str:
    """The type of a body without its parameters, lower case; empty if there is none."""
    return headers.get("content-type", "").partition(";")[0].strip().lower()


def replayed(body: bytes, receive: Receive) -> Receive:
    """A ``receive`` that yields a body which was read, and then what comes after it."""
    unread: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

    async def receive_again() -> Message:
        return unread.pop() if unread else await receive()

    return receive_again


def _too_large(limit_bytes: int) -> HttpProblem:
    return HttpProblem(
        "too_large",
        f"The body is larger than {limit_bytes // 1024} kB: no request here needs that.",
    )
