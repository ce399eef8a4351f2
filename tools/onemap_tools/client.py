"""HTTP client of the gateway; every failure raises CliError with one sentence for the user."""

from __future__ import annotations

from types import TracebackType
from typing import Any

import httpx

from onemap_shared.messages import FINAL_STATES
from onemap_tools.errors import EXIT_FAILED, EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.network import DEFAULT_URL

TIMEOUT_S = 5.0  # the gateway itself answers within its call_timeout_s of 3 s
FILE_TIMEOUT_S = 60.0  # a large map takes a while to write
MAX_PORT = 65535
MAX_FAILED_POLLS = 20  # in a row; a gateway that was killed restarts within that time
USAGE_ERROR_STATUSES = (400, 413, 415, 422)  # the request itself is wrong


class GatewayClient:
    """One gateway over HTTP; a context manager."""

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
            trust_env=False,  # the robot is in the local network: no proxy
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
        """Why a search cannot start now, in a sentence; empty if it can."""
        try:
            reply = self._http.get("/readyz")
        except httpx.HTTPError:
            return "The gateway does not answer yet."
        return "" if reply.is_success else _detail(reply)

    def query(self, text: str, max_regions: int) -> dict[str, Any]:
        """Regions of the map that match a text, best first."""
        return self._json("POST", "/v1/queries", {"text": text, "max_regions": max_regions})

    def start_search(self, objects: tuple[str, ...]) -> dict[str, Any]:
        """Start a search for these objects, one after the other."""
        return self._json("POST", "/v1/searches", {"objects": list(objects)})

    def search(self, search_id: str) -> dict[str, Any]:
        """The state of a search."""
        return self._json("GET", f"/v1/searches/{search_id}")

    def cancel(self, search_id: str) -> dict[str, Any]:
        """Cancel a search."""
        return self._json("DELETE", f"/v1/searches/{search_id}")

    def status(self) -> dict[str, Any]:
        """Condition of every service and stream."""
        return self._json("GET", "/v1/status")

    def map_info(self) -> dict[str, Any]:
        """Extent, areas, memory and update rate of the map."""
        return self._json("GET", "/v1/map")

    def map_archive(self) -> bytes:
        """The map as an ``.npz`` file."""
        return self._request("GET", "/v1/map.npz", None, FILE_TIMEOUT_S).content

    def map_save(self, name: str) -> dict[str, Any]:
        """Save the map in the mapper's map folder."""
        return self._json("POST", "/v1/map/save", {"name": name}, FILE_TIMEOUT_S)

    def map_load(self, name: str) -> dict[str, Any]:
        """Replace the map by a saved one."""
        return self._json("POST", "/v1/map/load", {"name": name}, FILE_TIMEOUT_S)

    def map_clear(self) -> dict[str, Any]:
        """Delete the content of the map."""
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
            usage_error = reply.status_code in USAGE_ERROR_STATUSES
            raise CliError(_detail(reply), EXIT_USAGE_ERROR if usage_error else EXIT_FAILED)
        return reply


class SearchHandle:
    """A search that is polled; tolerates a gateway that is away for a while."""

    def __init__(self, gateway: GatewayClient, report: dict[str, Any]) -> None:
        self._gateway = gateway
        self._failures = 0
        self.report = report

    @property
    def active(self) -> bool:
        """Whether the search was running at the last successful poll."""
        return self.report["state"] not in FINAL_STATES

    def poll(self) -> str:
        """Update the report; returns why that failed, empty on success.

        Raises CliError after ``MAX_FAILED_POLLS`` failures in a row.
        """
        try:
            self.report = self._gateway.search(self.report["id"])
        except CliError as error:
            self._failures += 1
            if self._failures > MAX_FAILED_POLLS:
                raise
            return str(error)
        self._failures = 0
        return ""

    def cancel(self) -> None:
        """Cancel the search and keep its final report."""
        self.report = self._gateway.cancel(self.report["id"])


def checked_url(url: str) -> httpx.URL:
    """Parse the URL of a gateway; CliError if it is not an http(s) URL with a host."""
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
    """The ``detail`` of a problem document, or the status line."""
    try:
        document = reply.json()
    except ValueError:
        document = {}
    detail = document.get("detail") if isinstance(document, dict) else None
    if isinstance(detail, str) and detail:
        return detail
    return f"{reply.request.url} answers {reply.status_code} {reply.reason_phrase}."
