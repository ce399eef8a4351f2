"""Errors of the client as a command reports them, and a search that is polled."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

from onemap import Client, OneMapError, Unreachable
from onemap_tools.errors import EXIT_FAILED, EXIT_USAGE_ERROR, CliError
from onemap_tools.gateway import MAX_FAILED_POLLS, SearchHandle, cli_error, gateway_client
from onemap_tools.processes.network import any_free_port

EXPLORING: dict[str, Any] = {"id": "s1", "state": "exploring", "objects": ["sofa"], "results": []}


def handle_of(*replies: tuple[int, dict[str, Any]]) -> SearchHandle:
    """A search that was started, and whose requests get these replies, the last one for ever."""
    waiting = [(201, EXPLORING), *replies]

    def answer(_: httpx.Request) -> httpx.Response:
        status, body = waiting.pop(0) if len(waiting) > 1 else waiting[0]
        return httpx.Response(status, json=body)

    return SearchHandle(Client(transport=httpx.MockTransport(answer)).search("sofa"))


def test_without_a_gateway_the_option_is_named() -> None:
    url = f"http://127.0.0.1:{any_free_port()}"
    with pytest.raises(CliError) as error, gateway_client(url) as gateway:
        gateway.status()
    assert str(error.value) == (
        f"No gateway at {url}: start everything with 'onemap up' or 'onemap demo', "
        "or give its address with --url."
    )
    assert error.value.exit_code == EXIT_FAILED


def test_a_timeout_is_reported_as_it_is() -> None:
    assert str(cli_error(Unreachable("It hangs.", "http://robot", timed_out=True))) == "It hangs."


@pytest.mark.parametrize(
    ("status", "code"), [(422, EXIT_USAGE_ERROR), (409, EXIT_FAILED), (503, EXIT_FAILED)]
)
def test_a_refusal_has_the_exit_code_of_its_status(status: int, code: int) -> None:
    error = cli_error(OneMapError("No.", status=status))
    assert (str(error), error.exit_code) == ("No.", code)


def test_a_wrong_url_is_a_usage_error() -> None:
    with pytest.raises(CliError, match="no address of a gateway") as error, gateway_client("robot"):
        pass
    assert error.value.exit_code == EXIT_USAGE_ERROR


def test_a_search_handle_tolerates_an_absent_gateway_for_a_while() -> None:
    detail = "The planner is not running."
    handle = handle_of((503, {"detail": detail}))
    for _ in range(MAX_FAILED_POLLS):
        assert handle.poll() == detail
    with pytest.raises(OneMapError, match="planner"):
        handle.poll()
    assert handle.active


def test_a_search_handle_updates_its_report() -> None:
    found = {**EXPLORING, "state": "found", "new": 1}
    handle = handle_of((200, found))
    assert handle.active
    assert handle.poll() == ""
    assert handle.report == found
    assert not handle.active


def test_a_cancelled_search_has_its_final_report() -> None:
    handle = handle_of((200, {**EXPLORING, "state": "cancelled"}))
    handle.cancel()
    assert handle.report["state"] == "cancelled"
