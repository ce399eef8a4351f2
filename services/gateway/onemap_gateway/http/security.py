"""Who may send which request, and the checks of host, origin, role and body before any route.

A browser lets every page of the web send requests to this machine. The headers ``Host`` and
``Origin`` tell those requests from the ones of the gateway's own page (DNS rebinding, CSRF).
"""
# Talks: reads a request's body, and the clock for the lock-out.

from __future__ import annotations

import logging
import time
from base64 import urlsafe_b64decode
from hashlib import sha256
from ipaddress import IPv6Address, IPv6Network, ip_address
from math import ceil
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
LOOKING = frozenset(("POST", path) for path in ("/v1/queries", "/v1/queries/events", "/v1/map.png"))
AGENTS = ("POST", "/mcp")

MAX_FAILURES = 10  # wrong tokens of one address within FAILURE_WINDOW_S
FAILURE_WINDOW_S = 60.0
LOCK_S = 60.0  # ten guesses a minute: 16 random characters hold for more than a lifetime
MAX_ADDRESSES = 1024  # of which wrong tokens are remembered


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


class LockOut:
    """Counts wrong tokens per address, and locks an address out after ``MAX_FAILURES`` of them.

    Also the right token is refused then: otherwise guessing could go on. Clients behind one
    proxy share an address, unless it is one of ``trusted_proxies``. Times are seconds
    of one monotonic clock.
    """

    def __init__(self) -> None:
        self._failures: dict[str, list[float]] = {}

    def locked_s(self, address: str, now_s: float) -> float:
        """Seconds for which the address is still locked out; 0 if it is not."""
        times = self._failures.get(client_network(address), [])
        return max(times[-1] + LOCK_S - now_s, 0.0) if len(times) >= MAX_FAILURES else 0.0

    def count(self, address: str, now_s: float) -> bool:
        """Count a wrong token; whether the address is locked out from now on."""
        client = client_network(address)
        times = [t for t in self._failures.pop(client, []) if now_s - t < FAILURE_WINDOW_S]
        while len(self._failures) >= MAX_ADDRESSES:
            self._failures.pop(next(iter(self._failures)))
        self._failures[client] = [*times, now_s][-MAX_FAILURES:]
        return len(self._failures[client]) >= MAX_FAILURES


def client_network(address: str) -> str:
    """What stands for one client: an address, of IPv6 the network /64, which is one household."""
    try:
        parsed = ip_address(address)
    except ValueError:
        return address
    if not isinstance(parsed, IPv6Address):
        return address
    return str(parsed.ipv4_mapped or IPv6Network((int(parsed), 64), strict=False))


MAX_BODY_BYTES = 64 * 1024
# Behind the prefix of any robot: the body of these may hold an image in base64, or many outlines.
LARGE_PATHS = ("/v1/queries", "/v1/map.png", "/v1/places.geojson")
MAX_IMAGE_BODY_BYTES = MAX_BODY_BYTES + (MAX_IMAGE_BYTES * 4 + 2) // 3
BODY_TIMEOUT_S = 10.0  # for 64 kB over a link of 6.5 kB/s, and for an image over 77 kB/s
# A browser cannot add a header to a WebSocket, so the page sends its token, in base64url without
# padding, as one of the subprotocols; the gateway chooses LIVE_PROTOCOL, never the token.
TOKEN_PROTOCOL = "onemap.token."
LIVE_PROTOCOL = "onemap.live"
JSON, GEOJSON = "application/json", "application/geo+json"
ROLE = "onemap.role"  # member of the scope: the role of the client, for routes that ask for it
LOG = logging.getLogger("onemap.gateway")


class SecurityMiddleware:
    """Refuses requests by host, origin, role, and by size, type and duration of the body."""

    def __init__(
        self, app: ASGIApp, config: GatewayConfig, lock_out: LockOut | None = None
    ) -> None:
        self._app = app
        self._hosts = frozenset(name.lower() for name in config.allowed_hosts)
        # by digest: how long a look-up takes tells nothing of a token
        self._roles = {_digest(t.encode()): role for role, t in config.tokens().items() if t}
        self._lock_out = lock_out or LockOut()

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
                scope[ROLE] = self._check_role(required, scope, headers)
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

    def _check_role(self, required: Role, scope: Scope, headers: Headers) -> Role:
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
        address, now_s = (scope.get("client") or ("", 0))[0], time.monotonic()
        if locked_s := self._lock_out.locked_s(address, now_s):
            wait_s = ceil(locked_s)
            raise HttpProblem(
                "locked_out",
                f"There were {MAX_FAILURES} wrong tokens from this address: wait {wait_s} s.",
                retry_after_s=wait_s,
            )
        role = self._roles.get(_digest(token), Role.NOBODY)
        if role is Role.NOBODY:
            if self._lock_out.count(address, now_s):
                LOG.warning("%d wrong tokens from %s: refused for a minute", MAX_FAILURES, address)
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
    if body and media_type(headers) not in (JSON, GEOJSON):
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
