"""Errors as a command reports them, and a search that is polled while its gateway is away."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

from onemap import Client, OneMapError
from onemap_tools.gateway import MAX_FAILED_POLLS, SearchHandle

EXPLORING: dict[str, Any] = {"id": "s1", "state": "exploring", "objects": ["sofa"], "results": []}


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
