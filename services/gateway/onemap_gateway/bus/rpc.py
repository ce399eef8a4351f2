"""Calls to the mapper and the planner from asynchronous code, bounded in number and in time."""
# Talks: calls on the bus from asynchronous code.

from __future__ import annotations

import asyncio
import math
from functools import partial
from typing import Any, TypeVar

import anyio
from anyio import CapacityLimiter, to_thread

from onemap_shared import keys
from onemap_shared.keys import Delivery, Procedure
from onemap_shared.transport import Bus, QueryTimeout

Q = TypeVar("Q")
R = TypeVar("R")

LATE_S = 0.5  # beyond the time limit of a call, which itself ends at that limit
# To one service, which handles one of a kind at a time anyway; queries have threads of their own.
MAX_CONCURRENT_CALLS = 4


def served_by(procedure: Procedure[Any, Any]) -> str:
    """The service that answers a procedure which the gateway calls."""
    if procedure is keys.EMBED_TEXT:
        return "perception"
    return "planner" if procedure.key.startswith("search/") else "mapper"


class RpcClient:
    """Calls procedures without blocking the event loop.

    Each service is called ``max_concurrent_calls`` times at once, so a service that hangs does not
    delay the replies of another; so is a procedure that is served in parallel. A call whose caller
    has gone counts until it ends, so that callers who give up leave no more work than others. What
    stops the robot waits for none of them.
    """

    def __init__(self, bus: Bus, max_concurrent_calls: int = MAX_CONCURRENT_CALLS) -> None:
        self._bus = bus
        self._max_concurrent_calls = max_concurrent_calls
        self._limiters: dict[str, CapacityLimiter] = {}
        self._unlimited = CapacityLimiter(math.inf)

    async def call(self, procedure: Procedure[Q, R], request: Q, timeout_s: float) -> R:
        """The reply; raises ``CallError``, also if the call's turn does not come in time."""
        began_s = anyio.current_time()
        turn, limiter = object(), self._limiter(procedure)
        try:
            with anyio.fail_after(timeout_s):
                await limiter.acquire_on_behalf_of(turn)
            waited_s = anyio.current_time() - began_s
            left_s, request = max(timeout_s - waited_s, 0.0), procedure.aged(request, waited_s)
            call = asyncio.create_task(self._in_thread(procedure, request, left_s))
        except TimeoutError:
            raise QueryTimeout from None

        def ended(done: asyncio.Task[R]) -> None:
            limiter.release_on_behalf_of(turn)
            _ = done.cancelled() or done.exception()  # nobody may wait for it any more

        call.add_done_callback(ended)
        try:
            with anyio.fail_after(left_s + LATE_S):
                return await asyncio.shield(call)
        except TimeoutError:
            raise QueryTimeout from None

    async def _in_thread(self, procedure: Procedure[Q, R], request: Q, timeout_s: float) -> R:
        call = partial(self._bus.call, procedure, request, timeout_s)
        return await to_thread.run_sync(call, abandon_on_cancel=True, limiter=self._unlimited)

    def _limiter(self, procedure: Procedure[Any, Any]) -> CapacityLimiter:
        if procedure.delivery is Delivery.COMMAND:
            return self._unlimited
        name, limit = served_by(procedure), self._max_concurrent_calls
        if procedure.parallel > 1:
            name, limit = procedure.key, procedure.parallel
        return self._limiters.setdefault(name, CapacityLimiter(limit))
