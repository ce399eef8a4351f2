"""Results that several clients ask for at once are computed once, a few at a time."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any

import pytest

from onemap_gateway.http.problems import HttpProblem
from onemap_gateway.http.shared_results import AT_ONCE, SharedResults

CLIENTS = 50


class Drawing:
    """Counts how often it is drawn, and how many at once; ends when told."""

    def __init__(self) -> None:
        self.count = self.now = self.most = 0
        self.may_end = asyncio.Event()

    async def draw(self) -> tuple[bytes, dict[str, str]]:
        self.count += 1
        self.now += 1
        self.most = max(self.most, self.now)
        await self.may_end.wait()
        self.now -= 1
        return b"%d" % self.count, {"X": "1"}


def run(scenario: Coroutine[Any, Any, None]) -> None:
    asyncio.run(asyncio.wait_for(scenario, 10))


def test_many_clients_share_one_result() -> None:
    async def scenario() -> None:
        drawing, results = Drawing(), SharedResults(wait_s=5)
        waiting = [
            asyncio.create_task(results.get("map", None, drawing.draw)) for _ in range(CLIENTS)
        ]
        await asyncio.sleep(0)
        waiting[0].cancel()  # the first one leaves
        drawing.may_end.set()
        bodies = await asyncio.gather(*waiting[1:])
        assert {result.body for result in bodies} == {b"1"}

    run(scenario())


def test_who_waits_too_long_is_told(caplog: pytest.LogCaptureFixture) -> None:
    async def scenario() -> None:
        drawing, results = Drawing(), SharedResults(wait_s=0.01)
        held = [
            asyncio.create_task(results.get(index, 1, drawing.draw)) for index in range(AT_ONCE)
        ]
        await asyncio.sleep(0)
        with pytest.raises(HttpProblem) as refusal:
            await results.get("another", 1, drawing.draw)
        assert refusal.value.code == "busy"
        drawing.may_end.set()
        await asyncio.gather(*held)

    run(scenario())
    assert caplog.text == ""
