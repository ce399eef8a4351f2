"""Results that many clients ask for at once: computed once, few at a time."""
# Talks: computes in tasks, a few at once.

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Hashable
from dataclasses import dataclass
from typing import Any, TypeAlias

import anyio
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from onemap_gateway.http.problems import HttpProblem

Maker: TypeAlias = Callable[[], Coroutine[Any, Any, tuple[bytes, dict[str, str]]]]

AT_ONCE = 2  # a core for each; one image of a large map needs up to 100 MB while it is drawn
KEPT_S = 0.5  # also of one revision the robot moves, and is drawn
MAX_KEPT = 8
SLICE_BYTES = 256 * 1024  # what is copied for one client at a time


@dataclass(frozen=True, slots=True)
class SharedResult:
    """A body and its headers, and when it was made."""

    body: bytes
    headers: dict[str, str]
    made_s: float = 0.0


class SharedResponse(Response):
    """Sends a body in slices, so that many clients can be sent one body without a copy for each."""

    async def __call__(self, _scope: Scope, _receive: Receive, send: Send) -> None:
        """The ASGI interface."""
        start = {"type": "http.response.start", "status": self.status_code}
        await send({**start, "headers": self.raw_headers})
        for begin in range(0, max(len(self.body), 1), SLICE_BYTES):
            end = begin + SLICE_BYTES
            part = {"type": "http.response.body", "body": bytes(self.body[begin:end])}
            await send({**part, "more_body": end < len(self.body)})


class SharedResults:
    """Results by what was asked for.

    Who asks for one that is being computed waits for it. One of the same version, not older than
    ``KEPT_S``, is given again; the version None is of data that may have changed.
    """

    def __init__(self, wait_s: float, clock_s: Callable[[], float] = anyio.current_time) -> None:
        self._wait_s = wait_s
        self._clock_s = clock_s
        self._slots = asyncio.Semaphore(AT_ONCE)
        self._tasks: dict[Hashable, asyncio.Task[SharedResult]] = {}

    async def get(self, request: Hashable, version: Hashable, make: Maker) -> SharedResult:
        """The result of ``make``, or that of another request for the same.

        Raises HttpProblem ``busy`` when other results take longer than ``wait_s``.
        """
        key = (request, version)
        task = self._tasks.get(key)
        if task is None or (task.done() and not self._fresh(task, version)):
            self._tasks.pop(key, None)
            task = self._tasks[key] = asyncio.create_task(self._compute(make))
            # the failure of one that nobody waits for any more is nobody's
            task.add_done_callback(lambda done: done.cancelled() or done.exception())
            for old in [each for each, kept in self._tasks.items() if kept.done()][:-MAX_KEPT]:
                del self._tasks[old]
        # one client that leaves may not take the result from the others
        return await asyncio.shield(task)

    def _fresh(self, task: asyncio.Task[SharedResult], version: Hashable) -> bool:
        if version is None or task.cancelled() or task.exception() is not None:
            return False
        return self._clock_s() - task.result().made_s <= KEPT_S

    async def _compute(self, make: Maker) -> SharedResult:
        try:
            await asyncio.wait_for(self._slots.acquire(), self._wait_s)
        except asyncio.TimeoutError:  # of Python 3.10; later it is the builtin one
            raise HttpProblem(
                "busy",
                f"The gateway draws at most {AT_ONCE} images at once, and is busy: try again.",
                service="gateway",
            ) from None
        try:
            body, headers = await make()
        finally:
            self._slots.release()
        return SharedResult(body, headers, self._clock_s())
