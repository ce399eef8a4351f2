"""Errors as a command reports them, and a search that is polled while its gateway is away."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

from onemap import Client, OneMapError, Unreachable
from onemap_tools.errors import (
    EXIT_FAILED,
    EXIT_INTERRUPTED,
    EXIT_USAGE_ERROR,
    CliError,
    requires_extra,
    to_cli_error,
)
from onemap_tools.gateway import MAX_FAILED_POLLS, SearchHandle, cli_error

EXPLORING: dict[str, Any] = {"id": "s1", "state": "exploring", "objects": ["sofa"], "results": []}


@pytest.mark.parametrize(
    ("cause", "sentence", "exit_code"),
    [
        (KeyboardInterrupt(), "Stopped.", EXIT_INTERRUPTED),
        (ValueError("no such key"), "no such key", EXIT_USAGE_ERROR),
        (CliError("not found"), "not found", EXIT_FAILED),
    ],
)
def test_every_cause_has_a_sentence_and_a_code(
    cause: BaseException, sentence: str, exit_code: int
) -> None:
    error = to_cli_error(cause)
    assert (str(error), error.exit_code) == (sentence, exit_code)


def test_a_missing_package_is_reported_with_its_extra() -> None:
    sentence = "The mapper needs the package 'torch': pip install -e '.[mapper]'"
    with pytest.raises(CliError) as error, requires_extra("mapper", "The mapper"):
        raise ModuleNotFoundError("No module named 'torch'", name="torch.nn")
    assert (str(error.value), error.value.exit_code) == (sentence, EXIT_USAGE_ERROR)
    # A missing module of ours is a bug.
    with pytest.raises(ModuleNotFoundError), requires_extra("mapper", "The mapper"):
        raise ModuleNotFoundError("No module named 'onemap_mapper.x'", name="onemap_mapper.x")


def test_a_timeout_is_reported_as_it_is() -> None:
    assert str(cli_error(Unreachable("It hangs.", "http://robot", timed_out=True))) == "It hangs."


def handle_of(*replies: tuple[int, dict[str, Any]]) -> SearchHandle:
    """A search that was started, and whose requests get these replies, the last one for ever."""
    waiting = [(201, EXPLORING), *replies]

    def answer(_: httpx.Request) -> httpx.Response:
        status, body = waiting.pop(0) if len(waiting) > 1 else waiting[0]
        return httpx.Response(status, json=body)

    return SearchHandle(Client(transport=httpx.MockTransport(answer)).search("sofa"))


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
