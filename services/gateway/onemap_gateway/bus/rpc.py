"""Calls to the mapper and the planner from asynchronous code, bounded in number and in time."""
# Talks: calls on the bus from asynchronous code.

from __future__ import annotations

from typing import Any, TypeVar

import anyio
from anyio import CapacityLimiter, to_thread

from onemap_shared import keys
from onemap_shared.keys import Procedure
from onemap_shared.transport import Bus, QueryTimeout

Q = TypeVar("Q")
R = TypeVar("R")

# Beyond the call's own time limit: waiting this long for a free thread means overload.
QUEUE_TIMEOUT_S = 0.5
# To one service, which handles one of a kind at a time anyway; queries have threads of their own.
MAX_CONCURRENT_CALLS = 4


def served_by(procedure: Procedure[Any, Any]) -> str:
    """The service that answers a procedure which the gateway calls."""
    if procedure is keys.EMBED_TEXT:
        return "perception"
    return "planner" if procedure.key.startswith("search/") else "mapper"


class RpcClient:
    """Calls procedures without blocking the event loop.

    Each service has its own ``max_concurrent_calls`` threads, so a service that hangs does not
    delay the replies of another; so has a procedure that is served in parallel.
    """

    def __init__(self, bus: Bus, max_concurrent_calls: int = MAX_CONCURRENT_CALLS) -> None:
        self._bus = bus
        self._max_concurrent_calls = max_concurrent_calls
        self._limiters: dict[str, CapacityLimiter] = {}

    async def call(self, procedure: Procedure[Q, R], request: Q, timeout_s: float) -> R:
        """The reply; raises ``CallError``, also if no thread becomes free in time."""
        try:
            with anyio.fail_after(timeout_s + QUEUE_TIMEOUT_S):
                return await to_thread.run_sync(
                    self._bus.call,
                    procedure,
                    request,
                    timeout_s,
                    abandon_on_cancel=True,
                    limiter=self._limiter(procedure),
                )
        except TimeoutError:
            raise QueryTimeout from None

    def _limiter(self, procedure: Procedure[Any, Any]) -> CapacityLimiter:
        name, limit = served_by(procedure), self._max_concurrent_calls
        if procedure.parallel > 1:
            name, limit = procedure.key, procedure.parallel
        return self._limiters.setdefault(name, CapacityLimiter(limit))
