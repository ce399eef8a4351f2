"""Calls to the mapper and the planner from asynchronous code, bounded in number and in time."""
# Talks: calls on the bus from asynchronous code.

from __future__ import annotations

from typing import TypeVar

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

MAPPER = (
    keys.MAP_SIMILARITY,
    keys.MAP_IMAGE_SIMILARITY,
    keys.MAP_SEARCH_VIEW,
    keys.MAP_SAVE,
    keys.MAP_LOAD,
    keys.MAP_LIST,
    keys.MAP_DELETE,
    keys.MAP_MERGE,
    keys.MAP_CLEAR,
    keys.MAP_OBJECTS,
    keys.MAP_OBJECT,
    keys.MAP_FORGET,
)
PLANNER = (keys.SEARCH_START, keys.SEARCH_CANCEL, keys.SEARCH_GET, keys.SEARCH_LIST)
SERVED_BY = {
    **{procedure.key: "mapper" for procedure in MAPPER},
    **{procedure.key: "planner" for procedure in PLANNER},
}


class RpcClient:
    """Calls procedures without blocking the event loop.

    Each service has its own ``max_concurrent_calls`` threads, so a service that hangs does not
    delay the replies of another; so has a procedure that is served in parallel.
    """

    def __init__(self, bus: Bus, max_concurrent_calls: int = MAX_CONCURRENT_CALLS) -> None:
        self._bus = bus
        self._limiters = {
            service: CapacityLimiter(max_concurrent_calls) for service in ("mapper", "planner")
        } | {
            procedure.key: CapacityLimiter(procedure.parallel)
            for procedure in (*MAPPER, *PLANNER)
            if procedure.parallel > 1
        }

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
                    limiter=self._limiter(procedure.key),
                )
        except TimeoutError:
            raise QueryTimeout from None

    def _limiter(self, key: str) -> CapacityLimiter:
        return self._limiters.get(key) or self._limiters[SERVED_BY[key]]
