"""Who may send which request: roles, their tokens, and the lock-out after wrong ones."""

from __future__ import annotations

import hmac
from collections.abc import Mapping
from hashlib import sha256
from ipaddress import IPv6Address, IPv6Network, ip_address

from onemap_gateway.config import Role

# The page and its documentation are the same for every robot, the two checks say only whether
# and which stage works. Everything else shows or changes this robot.
PUBLIC_PATHS = frozenset({"/", "/docs", "/openapi.json", "/favicon.ico", "/healthz", "/readyz"})
PUBLIC_FOLDER = "/static/"
READING = frozenset({"GET", "HEAD", "OPTIONS"})
# Requests that change nothing by themselves; each tool of an agent checks the role it needs.
LOOKING = frozenset(
    ("POST", path) for path in ("/v1/queries", "/v1/queries/events", "/v1/map.png", "/mcp")
)

MAX_FAILURES = 10  # wrong tokens of one address within FAILURE_WINDOW_S
FAILURE_WINDOW_S = 60.0
LOCK_S = 60.0  # ten guesses a minute: 16 random characters hold for more than a lifetime
MAX_ADDRESSES = 1024  # of which wrong tokens are remembered


def required_role(method: str, path: str) -> Role:
    """The least role that may send this request; changes without a rule need the highest."""
    if method in READING:
        public = path in PUBLIC_PATHS or path.startswith(PUBLIC_FOLDER)
        return Role.NOBODY if public else Role.LOOK
    if (method, path) in LOOKING:
        return Role.LOOK
    folder, _, name = path.rpartition("/")
    if (method, path) == ("POST", "/v1/searches") or (
        method == "DELETE" and folder == "/v1/searches" and name
    ):
        return Role.SEARCH
    return Role.ADMINISTER


class TokenTable:
    """The role of a token, compared in the same time whatever is presented."""

    def __init__(self, tokens: Mapping[Role, str]) -> None:
        # digests have one length: a comparison tells nothing of the token's own
        self._digests = [(role, _digest(token.encode())) for role, token in tokens.items() if token]

    @property
    def open(self) -> bool:
        """Whether there is no token, so that everybody may do everything."""
        return not self._digests

    def role(self, token: bytes) -> Role:
        """The role of the token; NOBODY if it is none."""
        given, found = _digest(token), Role.NOBODY
        for role, digest in self._digests:
            if hmac.compare_digest(given, digest):
                found = role
        return found


def _digest(token: bytes) -> bytes:
    return sha256(token).digest()


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
