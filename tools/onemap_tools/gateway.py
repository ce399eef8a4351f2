"""The gateway for commands: errors of the client end them with a sentence and an exit code."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from onemap import Client, InvalidSetting, OneMapError, RemoteSearch, Unreachable
from onemap_shared.messages import SearchState
from onemap_tools.errors import EXIT_FAILED, EXIT_USAGE_ERROR, CliError

TARGET = "onemap.target"
UNITS = (Path("/usr/local/lib/systemd/system"), Path("/etc/systemd/system"))  # as install.sh has it
MAX_FAILED_POLLS = 20  # in a row; a gateway that was killed restarts within that time
USAGE_ERROR_STATUSES = (400, 413, 415, 422)  # the request itself is wrong


@contextmanager
def gateway_client(url: str, token: str = "") -> Iterator[Client]:
    """A client of the gateway at ``url``; its errors become CliErrors."""
    try:
        with Client(url, token) as client:
            yield client
    except OneMapError as error:
        raise cli_error(error) from error


def cli_error(error: OneMapError) -> CliError:
    """The error that ends a command."""
    if isinstance(error, Unreachable) and not (error.timed_out or error.misdirected):
        return CliError(
            f"No gateway at {error.url}: start everything with {start_all()}, or give its address "
            "with --url."
        )
    usage_error = isinstance(error, InvalidSetting) or error.status in USAGE_ERROR_STATUSES
    return CliError(error.detail, EXIT_USAGE_ERROR if usage_error else EXIT_FAILED)


def start_all() -> str:
    """The command that starts everything on this machine: where units are installed, systemd's."""
    installed = any((folder / TARGET).exists() for folder in UNITS)
    return f"'sudo systemctl start {TARGET}'" if installed else "'onemap up' or 'onemap demo'"


class SearchHandle:
    """A search that is polled; tolerates a gateway that is away for a while."""

    def __init__(self, search: RemoteSearch) -> None:
        self._search = search
        self._failures = 0

    @property
    def active(self) -> bool:
        """Whether the search was running at the last successful poll."""
        return self._search.latest.active

    @property
    def report(self) -> dict[str, Any]:
        """The gateway's report at the last successful poll."""
        return dict(self._search.latest.document)

    @property
    def interrupted(self) -> bool:
        """Whether it ended with its planner or driver: it can be asked for again."""
        return self._search.latest.state == SearchState.INTERRUPTED.value

    def cancel(self, waiting: Callable[[str], None] = lambda _: None) -> None:
        """End the search, and keep its final report; ``waiting`` is told why it takes longer."""
        self._search.cancel(waiting)

    def poll(self) -> str:
        """Update the report; returns why that failed, empty on success.

        Raises OneMapError after ``MAX_FAILED_POLLS`` failures in a row.
        """
        return self._asked(self._search.status)

    def again(self) -> str:
        """Ask for what is left of an interrupted search, which becomes this one; as ``poll``."""

        def ask() -> None:
            self._search = self._search.again()

        return self._asked(ask)

    def _asked(self, ask: Callable[[], object]) -> str:
        try:
            ask()
        except OneMapError as error:
            self._failures += 1
            if self._failures > MAX_FAILED_POLLS:
                raise
            if not isinstance(error, Unreachable):
                return error.detail
            attempt = f"attempt {self._failures} of {MAX_FAILED_POLLS}"
            return f"The gateway does not answer: {attempt}, the search itself goes on."
        self._failures = 0
        return ""
