"""HTTP to one gateway; every failure raises a OneMapError."""
# Talks: HTTP.

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TypeVar

import httpx

from onemap.errors import InvalidSetting, OneMapError, Unreachable, problem_error

DEFAULT_URL = "http://127.0.0.1:8080"
TIMEOUT_S = 5.0  # the gateway itself answers within its call_timeout_s of 3 s
FILE_TIMEOUT_S = 60.0  # a large map takes a while to write
SILENCE_S = 40.0  # an event stream without a change has a comment every 15 s
MAX_PORT = 65535

Reply = TypeVar("Reply")


class Connection:
    """Requests to the gateway at ``url``."""

    def __init__(
        self, url: str, token: str, timeout_s: float, transport: httpx.BaseTransport | None
    ) -> None:
        if not (token.isascii() and token.isprintable()):
            raise InvalidSetting("The token may hold only printable ASCII characters.")
        self.url = url
        self._timeout_s = timeout_s
        self._http = httpx.Client(
            base_url=checked_url(url),
            headers={"Authorization": f"Bearer {token}"} if token else {},
            transport=transport,
            trust_env=False,  # the robot is in the local network: no proxy
        )

    def close(self) -> None:
        """Close the sockets."""
        self._http.close()

    def fetch(
        self,
        parse: Callable[[Mapping[str, Any]], Reply],
        method: str,
        path: str,
        body: Mapping[str, Any] | None = None,
        *,
        timeout_s: float = 0.0,
    ) -> Reply:
        """Send a request; returns what ``parse`` makes of the JSON object in the reply.

        ``timeout_s``: for requests that may take longer than others.
        """
        reply = self._request(method, path, body, timeout_s)
        try:
            return parse(reply.json())
        except (ValueError, TypeError, KeyError, AttributeError) as problem:
            raise self._foreign(reply.status_code) from problem

    def download(self, path: str, *, timeout_s: float = 0.0) -> bytes:
        """The content at a path."""
        return self._request("GET", path, None, timeout_s).content

    def stream(
        self, path: str, body: Mapping[str, Any] | None = None
    ) -> Generator[bytes, None, None]:
        """The body of a reply that has no end, as it comes; to a POST if there is a ``body``."""
        method, timeout = "POST" if body else "GET", httpx.Timeout(self._timeout_s, read=SILENCE_S)
        with (
            self._as_errors(SILENCE_S),
            self._http.stream(method, path, json=body, timeout=timeout) as reply,
        ):
            if not reply.is_success:
                reply.read()
                raise _refusal(reply)
            yield from reply.iter_bytes()

    def _request(
        self, method: str, path: str, body: Mapping[str, Any] | None, timeout_s: float
    ) -> httpx.Response:
        limit_s = max(timeout_s, self._timeout_s)
        with self._as_errors(limit_s):
            reply = self._http.request(method, path, json=body, timeout=limit_s)
        if not reply.is_success:
            raise _refusal(reply)
        return reply

    @contextmanager
    def _as_errors(self, limit_s: float) -> Iterator[None]:
        """Turn errors of the transport into ``Unreachable``."""
        try:
            yield
        except httpx.TimeoutException as problem:
            raise Unreachable(
                f"The gateway at {self.url} did not answer within {limit_s:g} s: "
                "'onemap doctor' looks for the reason.",
                self.url,
                timed_out=True,
            ) from problem
        except httpx.HTTPError as problem:
            raise Unreachable(
                f"No gateway at {self.url}: start everything with 'onemap up' or 'onemap demo', "
                f"or give its address, as in Client({DEFAULT_URL!r}).",
                self.url,
            ) from problem

    def _foreign(self, status: int) -> OneMapError:
        return OneMapError(
            f"{self.url} answers, but not like OneMap's gateway: is another program there?",
            status=status,
        )


def checked_url(url: str) -> httpx.URL:
    """Parse the URL of a gateway; InvalidSetting if it is not an http(s) URL with a host."""
    try:
        parsed = httpx.URL(url)
    except httpx.InvalidURL as problem:
        raise InvalidSetting(f"{url!r} is not a URL: {problem}") from problem
    known = parsed.scheme in ("http", "https") and (parsed.port or 0) <= MAX_PORT
    if not known or not parsed.host or len(url.split()) != 1:
        raise InvalidSetting(
            f"{url!r} is no address of a gateway: it should look like {DEFAULT_URL}"
        )
    return parsed


def _refusal(reply: httpx.Response) -> OneMapError:
    try:
        document = reply.json()
    except ValueError:
        document = None
    otherwise = f"{reply.request.url} answers {reply.status_code} {reply.reason_phrase}."
    return problem_error(reply.status_code, document, otherwise)
