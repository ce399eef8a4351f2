"""Questions to the other services from asynchronous code: bounded in number and in time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import anyio
from anyio import CapacityLimiter, to_thread

from onemap_gateway.http.problems import from_call_error, never_hung
from onemap_shared import keys
from onemap_shared.keys import Procedure
from onemap_shared.transport import Bus, CallError, QueryTimeout

Q = TypeVar("Q")
R = TypeVar("R")

QUEUE_S = 0.5  # beyond the call's own time: waiting this long for a free thread means overload


MAPPER = (keys.MAP_SIMILARITY, keys.MAP_SEARCH_VIEW, keys.MAP_SAVE, keys.MAP_LOAD, keys.MAP_CLEAR)
PLANNER = (keys.SEARCH_START, keys.SEARCH_CANCEL, keys.SEARCH_GET)
SERVED_BY = {
    **{procedure.key: "mapper" for procedure in MAPPER},
    **{procedure.key: "planner" for procedure in PLANNER},
}


class RpcClient:
    """Asks the mapper and the planner without blocking the event loop.

    Each service has its own few threads, so one that hangs cannot keep the others' answers
    from coming; who finds all of them taken is told so in time. ``hung``: see ``from_call_error``.
    """

    def __init__(
        self,
        bus: Bus,
        timeout_s: float,
        max_concurrent_calls: int,
        hung: Callable[[str], str] = never_hung,
    ) -> None:
        self._bus = bus
        self._hung = hung
        self._timeout_s = timeout_s
        self._limiters = {
            service: CapacityLimiter(max_concurrent_calls) for service in ("mapper", "planner")
        }

    async def call(
        self, procedure: Procedure[Q, R], request: Q, timeout_s: float | None = None
    ) -> R:
        """The answer, or a ``HttpProblem`` that names the service."""
        service = SERVED_BY[procedure.key]
        limit_s = timeout_s or self._timeout_s
        try:
            with anyio.fail_after(limit_s + QUEUE_S):
                return await to_thread.run_sync(
                    self._bus.call,
                    procedure,
                    request,
                    limit_s,
                    abandon_on_cancel=True,
                    limiter=self._limiters[service],
                )
        except TimeoutError:
            raise from_call_error(QueryTimeout(), service, limit_s, self._hung) from None
        except CallError as error:
            raise from_call_error(error, service, limit_s, self._hung) from error
