"""The gateway as a program sees it. Whatever goes wrong becomes one sentence for the user."""

from __future__ import annotations

from types import TracebackType
from typing import Any

import httpx

from onemap_tools.errors import EXIT_FAILED, EXIT_USAGE_ERROR, CliError

DEFAULT_URL = "http://127.0.0.1:8080"
TIMEOUT_S = 5.0  # the gateway itself answers within its call_timeout_s of 3 s
FILE_TIMEOUT_S = 60.0  # a large map takes a while to write
MAX_PORT = 65535
USAGE_ERROR_STATUSES = (400, 413, 415, 422)  # the request is wrong by its words, whoever is there


class GatewayClient:
    """Talks HTTP to one gateway; a context manager."""

    def __init__(
        self, url: str = DEFAULT_URL, token: str = "", transport: httpx.BaseTransport | None = None
    ) -> None:
        if not (token.isascii() and token.isprintable()):
            raise CliError("The token may hold only printable ASCII characters.", EXIT_USAGE_ERROR)
        self._http = httpx.Client(
            base_url=checked_url(url),
            headers={"Authorization": f"Bearer {token}"} if token else {},
            timeout=TIMEOUT_S,
            transport=transport,
            trust_env=False,  # a proxy for the internet has no business on the way to a robot
        )
        self.url = url

    def __enter__(self) -> GatewayClient:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._http.close()

    def missing_stage(self) -> str:
        """Why a search could not start now, in a sentence; empty if it could."""
        try:
            reply = self._http.get("/readyz")
        except httpx.HTTPError:
            return "The gateway does not answer yet."
        return "" if reply.is_success else _detail(reply)

    def query(self, text: str, max_regions: int) -> dict[str, Any]:
        """Where is it?"""
        return self._json("POST", "/v1/queries", {"text": text, "max_regions": max_regions})

    def start_search(self, objects: tuple[str, ...]) -> dict[str, Any]:
        """Send the robot to find these objects, one after the other."""
        return self._json("POST", "/v1/searches", {"objects": list(objects)})

    def search(self, search_id: str) -> dict[str, Any]:
        """How that search stands."""
        return self._json("GET", f"/v1/searches/{search_id}")

    def cancel(self, search_id: str) -> dict[str, Any]:
        """Stop that search."""
        return self._json("DELETE", f"/v1/searches/{search_id}")

    def status(self) -> dict[str, Any]:
        """What runs, and how."""
        return self._json("GET", "/v1/status")

    def map_info(self) -> dict[str, Any]:
        """The map in numbers."""
        return self._json("GET", "/v1/map")

    def map_archive(self) -> bytes:
        """The map as an ``.npz`` file."""
        return self._request("GET", "/v1/map.npz", None, FILE_TIMEOUT_S).content

    def map_save(self, name: str) -> dict[str, Any]:
        """Write the map to a file of the mapper's."""
        return self._json("POST", "/v1/map/save", {"name": name}, FILE_TIMEOUT_S)

    def map_load(self, name: str) -> dict[str, Any]:
        """Replace the map by one that was saved."""
        return self._json("POST", "/v1/map/load", {"name": name}, FILE_TIMEOUT_S)

    def map_clear(self) -> dict[str, Any]:
        """Empty the map."""
        return self._json("POST", "/v1/map/clear")

    def _json(
        self,
        method: str,
        path: str,
        body: dict[str, Any] | None = None,
        timeout_s: float = TIMEOUT_S,
    ) -> dict[str, Any]:
        reply = self._request(method, path, body, timeout_s)
        try:
            document = reply.json()
        except ValueError:
            document = None
        if not isinstance(document, dict):
            raise CliError(
                f"{self.url} answers, but not like OneMap's gateway: is another program there?"
            )
        return document

    def _request(
        self, method: str, path: str, body: dict[str, Any] | None, timeout_s: float
    ) -> httpx.Response:
        try:
            reply = self._http.request(method, path, json=body, timeout=timeout_s)
        except httpx.TimeoutException as problem:
            raise CliError(
                f"The gateway at {self.url} did not answer within {timeout_s:g} s: "
                "'onemap doctor' looks for the reason."
            ) from problem
        except httpx.HTTPError as problem:
            raise CliError(
                f"No gateway at {self.url}: start everything with 'onemap up' or 'onemap demo', "
                "or give its address with --url."
            ) from problem
        if not reply.is_success:
            misused = reply.status_code in USAGE_ERROR_STATUSES
            raise CliError(_detail(reply), EXIT_USAGE_ERROR if misused else EXIT_FAILED)
        return reply


def checked_url(url: str) -> httpx.URL:
    """The address of a gateway; CliError if it is none."""
    try:
        parsed = httpx.URL(url)
    except httpx.InvalidURL as problem:
        raise CliError(f"{url!r} is not a URL: {problem}", EXIT_USAGE_ERROR) from problem
    known = parsed.scheme in ("http", "https") and (parsed.port or 0) <= MAX_PORT
    if not known or not parsed.host or len(url.split()) != 1:
        raise CliError(
            f"{url!r} is no address of a gateway: it should look like {DEFAULT_URL}",
            EXIT_USAGE_ERROR,
        )
    return parsed


def _detail(reply: httpx.Response) -> str:
    """The sentence of a problem document."""
    try:
        document = reply.json()
    except ValueError:
        document = {}
    detail = document.get("detail") if isinstance(document, dict) else None
    if isinstance(detail, str) and detail:
        return detail
    return f"{reply.request.url} answers {reply.status_code} {reply.reason_phrase}."
