"""HTTP to one gateway: requests, event streams, and what can go wrong.

Every failure raises a OneMapError, whose text is one sentence that says what to do.
"""
# Talks: HTTP, and waits before it connects again.

from __future__ import annotations

import json
import socket
import ssl
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import httpx

DEFAULT_URL = "http://127.0.0.1:8080"
TIMEOUT_S = 5.0  # the gateway itself answers within its call_timeout_s of 3 s
FILE_TIMEOUT_S = 60.0  # a large map takes a while to write
SEARCHES = "/v1/searches/"
STOP_PATIENCE_S = 10.0  # a gateway or planner that was killed is back by then
STOP_TIMEOUT_S = 2.0  # of one attempt: the gateway answers within 0.1 s, or is not there
STOP_PAUSE_S = 0.2
SILENCE_S = 40.0  # an event stream without a change has a comment every 15 s
MAX_PORT = 65535
WRONG_HOST = (62, 64)  # X509_V_ERR_HOSTNAME_MISMATCH, X509_V_ERR_IP_ADDRESS_MISMATCH

Parsed = TypeVar("Parsed")
Asked = TypeVar("Asked")
GATEWAY_ERRORS = (502, 503, 504)  # a service, or the gateway behind a proxy, is away for a while


class OneMapError(Exception):
    """A request that was refused or failed.

    status: the HTTP status, 0 if there was no reply.
    document: the problem details (RFC 9457) with all their members; empty without any.
    """

    def __init__(
        self, detail: str, *, status: int = 0, document: Mapping[str, Any] | None = None
    ) -> None:
        super().__init__(detail)
        self.detail = detail
        self.status = status
        self.document: Mapping[str, Any] = document or {}

    @property
    def type(self) -> str:
        """Which problem, such as ``/docs#problem-unknown_word``; empty if unknown."""
        return str(self.document.get("type", ""))

    @property
    def title(self) -> str:
        """The problem in a few words; empty if unknown."""
        return str(self.document.get("title", ""))

    @property
    def hints(self) -> dict[str, tuple[str, ...]]:
        """For each word that the encoder does not know, the known words nearest to it."""
        words = self.document.get("words", ())
        return {str(each["word"]): tuple(each.get("did_you_mean", ())) for each in words}

    @property
    def search_id(self) -> str:
        """The search that runs already, which refused this one (409); else empty."""
        return str(self.document.get("search_id", ""))

    @property
    def temporary(self) -> bool:
        """Whether the same request may succeed a little later."""
        return self.status in GATEWAY_ERRORS


class Unreachable(OneMapError):
    """The gateway at ``url`` did not answer.

    ``timed_out``: something accepted the connection, but did not answer in time.
    ``misdirected``: the address or the certificate is wrong: to start a gateway does not help.
    """

    def __init__(
        self, detail: str, url: str, *, timed_out: bool = False, misdirected: bool = False
    ) -> None:
        super().__init__(detail)
        self.url = url
        self.timed_out = timed_out
        self.misdirected = misdirected

    @property
    def temporary(self) -> bool:
        """Whether the same request may succeed a little later."""
        return True


class InvalidSetting(OneMapError, ValueError):
    """An address, a token, a place or the name of a map that cannot be used."""


@dataclass(frozen=True, slots=True)
class Retry:
    """How an interrupted event stream is opened again: after ``first_s``, then twice that, ...

    attempts: in a row without any event, before the error is raised. A gateway that was killed is
    back within seconds.
    """

    first_s: float = 0.5
    most_s: float = 5.0
    attempts: int = 10

    def delay_s(self, failures: int) -> float:
        """Seconds to wait after this many failures in a row, 0 or more."""
        return min(self.first_s * 2.0 ** max(failures - 1, 0), self.most_s)


@dataclass(frozen=True, slots=True)
class StreamInterrupted:
    """There are no events at the moment; ``detail`` is a sentence that says why."""

    detail: str

    def __str__(self) -> str:
        """The sentence."""
        return self.detail


class Connection:
    """Requests to the gateway at ``url``."""

    def __init__(
        self,
        url: str,
        token: str,
        timeout_s: float,
        transport: httpx.BaseTransport | None,
        retry: Retry,
        *,
        verify: ssl.SSLContext | bool = True,
    ) -> None:
        if not (token.isascii() and token.isprintable()):
            raise InvalidSetting("The token may hold only printable ASCII characters.")
        self.url = url
        self._timeout_s = timeout_s
        self._retry = retry
        self._http = httpx.Client(
            base_url=checked_url(url),
            headers={"Authorization": f"Bearer {token}"} if token else {},
            transport=transport,
            verify=verify,
            trust_env=False,  # the robot is in the local network: no proxy
        )

    def close(self) -> None:
        """Close the sockets."""
        self._http.close()

    def fetch(
        self,
        parse: Callable[[Mapping[str, Any]], Parsed],
        method: str,
        path: str,
        body: Mapping[str, Any] | None = None,
        *,
        timeout_s: float = 0.0,
    ) -> Parsed:
        """Send a request; returns what ``parse`` makes of the JSON object in the reply.

        ``timeout_s``: for requests that may take longer than others.
        """
        reply = self._request(method, path, body, timeout_s)
        try:
            return parse(reply.json())
        except (ValueError, TypeError, KeyError, AttributeError) as problem:
            raise OneMapError(
                f"{self.url} answers, but not like OneMap's gateway: is another program there?",
                status=reply.status_code,
            ) from problem

    def repeated(self, ask: Callable[[], Asked]) -> Asked:
        """What a request returns; asked again while a service is away (see ``Retry``)."""
        failures = 0
        while True:
            try:
                return ask()
            except OneMapError as error:
                failures += 1
                if not error.temporary or failures > self._retry.attempts:
                    raise
            time.sleep(self._retry.delay_s(failures))

    def stop(
        self,
        parse: Callable[[Mapping[str, Any]], Parsed],
        path: str,
        waiting: Callable[[str], None] = lambda _: None,
    ) -> Parsed:
        """DELETE until it is confirmed; ``waiting`` is told why it was not yet.

        One that arrived, but whose answer was lost, is confirmed by the next. Raises OneMapError
        if it is refused, or not confirmed within ``STOP_PATIENCE_S``.
        """
        deadline_s, reported = time.monotonic() + STOP_PATIENCE_S, ""
        while True:
            try:
                return self.fetch(parse, "DELETE", path)
            except OneMapError as error:
                if not error.temporary:
                    raise
                if time.monotonic() >= deadline_s:
                    raise OneMapError(
                        f"The robot may still drive: no stop was confirmed within "
                        f"{STOP_PATIENCE_S:g} s. Use its emergency stop, or end the planner. "
                        f"{error.detail}",
                        status=error.status,
                        document=error.document,
                    ) from error
                if error.detail != reported:
                    reported = error.detail
                    waiting(reported)
            time.sleep(STOP_PAUSE_S)

    def download(self, path: str, *, timeout_s: float = 0.0) -> bytes:
        """The content at a path."""
        return self._request("GET", path, None, timeout_s).content

    def follow(
        self, path: str, event: str, parse: Callable[[Mapping[str, Any]], Parsed]
    ) -> Iterator[Parsed | StreamInterrupted]:
        """The data of each server-sent ``event``, and of each ``problem``, without end.

        An interrupted stream is opened again, and each attempt that fails is told. Raises
        OneMapError if the stream is refused or the gateway stays away (see ``Retry``).
        """
        failures = 0
        while True:
            failures += 1  # as long as no event comes
            try:
                with closing(self._stream(path)) as chunks:
                    for message in stream_messages(chunks):
                        failures = 1
                        if message.event == event:
                            yield _parsed(message, parse)
                        elif message.event == "problem":
                            detail = _parsed(message, lambda problem: str(problem["detail"]))
                            yield StreamInterrupted(detail)
            except OneMapError as error:
                if not error.temporary or failures > self._retry.attempts:
                    raise
                yield StreamInterrupted(error.detail)
            else:
                if failures > self._retry.attempts:
                    raise OneMapError(
                        f"{self.url} ended {failures} event streams in a row without an event: is "
                        "a proxy there that cuts them?"
                    )
            time.sleep(self._retry.delay_s(failures))

    def _stream(self, path: str) -> Generator[bytes, None, None]:
        """The body of a reply that has no end, as it comes."""
        timeout = httpx.Timeout(self._timeout_s, read=SILENCE_S)
        with (
            self._as_errors(SILENCE_S),
            self._http.stream("GET", path, timeout=timeout) as reply,
        ):
            if not reply.is_success:
                reply.read()
                raise _refusal(reply)
            yield from reply.iter_bytes()

    def _request(
        self, method: str, path: str, body: Mapping[str, Any] | None, timeout_s: float
    ) -> httpx.Response:
        limit_s = max(timeout_s, self._timeout_s)
        if method == "DELETE" and path.startswith(SEARCHES):
            limit_s = STOP_TIMEOUT_S
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
            if reason := _misdirected(problem, self.url):
                raise Unreachable(reason, self.url, misdirected=True) from problem
            raise Unreachable(
                f"No gateway at {self.url}: start everything with 'onemap up' or 'onemap demo', "
                f"or give its address, as in Client({DEFAULT_URL!r}).",
                self.url,
            ) from problem


def _misdirected(problem: BaseException | None, url: str) -> str:
    """What is wrong with an address or its certificate, and what to do; empty if it is neither."""
    host = httpx.URL(url).host
    while problem is not None:
        match problem:
            case socket.gaierror():
                return f"No address is known for {host}: correct the name in {url}."
            case ssl.SSLCertVerificationError(verify_code=code) if code in WRONG_HOST:
                return (
                    f"The certificate at {url} is for another name than {host}: use that name, or "
                    "give the gateway's proxy a certificate for this one."
                )
            case ssl.SSLCertVerificationError():
                return (
                    f"The certificate at {url} is not trusted ({problem.verify_message}): name the "
                    "authority's file in ONEMAP_CA, or as Client(verify=...)."
                )
            case ssl.SSLError():
                return f"{url} does not speak TLS as expected: is it http:// there?"
        problem = problem.__cause__ or problem.__context__
    return ""


def trusted(ca_file: str) -> ssl.SSLContext | bool:
    """What verifies certificates: with the authorities of this file, or the usual ones without."""
    if not ca_file:
        return True
    try:
        return ssl.create_default_context(cafile=ca_file)
    except (OSError, ssl.SSLError) as problem:
        raise InvalidSetting(
            f"ONEMAP_CA names {ca_file}, which cannot be read as certificates in PEM: {problem}."
        ) from problem


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
    problem = document if isinstance(document, dict) else {}
    detail = problem.get("detail")
    if not isinstance(detail, str) or not detail:
        detail = f"{reply.request.url} answers {reply.status_code} {reply.reason_phrase}."
    return OneMapError(detail, status=reply.status_code, document=problem)


@dataclass(frozen=True, slots=True)
class StreamMessage:
    """One message of an event stream, as it came."""

    event: str
    data: str


def stream_messages(chunks: Iterable[bytes]) -> Iterator[StreamMessage]:
    """The messages of a ``text/event-stream``; lines end with LF or CR LF.

    Comments, and fields other than ``event`` and ``data``, are ignored. A message that was cut off
    is not complete, and left out.
    """
    event, data = "", list[str]()
    for line in _lines(chunks):
        name, _, value = line.partition(":")
        value = value.removeprefix(" ")
        if not line and data:
            yield StreamMessage(event or "message", "\n".join(data))
        if not line:
            event, data = "", []
        elif name == "event":
            event = value
        elif name == "data":
            data.append(value)


def _lines(chunks: Iterable[bytes]) -> Iterator[str]:
    """Complete lines. Splitting bytes leaves line separators inside a text, such as U+2028, be."""
    rest = b""
    for chunk in chunks:
        *lines, rest = (rest + chunk).split(b"\n")
        yield from (line.removesuffix(b"\r").decode("utf-8", "replace") for line in lines)


def _parsed(message: StreamMessage, parse: Callable[[Mapping[str, Any]], Parsed]) -> Parsed:
    try:
        return parse(json.loads(message.data))
    except (ValueError, TypeError, KeyError, AttributeError) as problem:
        raise OneMapError(
            f"An event cannot be read: {message.data[:100]!r}. Do client and gateway have the "
            "same version?"
        ) from problem
