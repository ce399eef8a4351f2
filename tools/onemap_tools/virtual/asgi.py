"""The gateway in virtual time: its application without a server, called as over HTTP.

Its event loop runs in a thread of its process, waits in virtual time, and lets what asyncio would
give to a thread run in one of the world's.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

import anyio.to_thread

from onemap_gateway.bus.rpc import RpcClient
from onemap_gateway.bus.state_cache import StateCache
from onemap_gateway.config import GatewayConfig
from onemap_gateway.http.app import create_app
from onemap_gateway.http.context import GatewayContext
from onemap_shared.clock import Clock
from onemap_shared.transport import Bus, Health

T = TypeVar("T")
ANSWERS_WITHIN_S = 10.0  # a client gives up
HOST = b"127.0.0.1"


class _Waiting:
    """What a loop calls a selector: waits until something is to be done."""

    def __init__(self, clock: Clock) -> None:
        self.wake = clock.event()

    def select(self, timeout_s: float | None) -> list[object]:
        """Wait; there are no sockets."""
        self.wake.wait(timeout_s)
        self.wake.clear()
        return []


class VirtualLoop(asyncio.BaseEventLoop):
    """An event loop whose time is that of a process."""

    def __init__(self, clock: Clock) -> None:
        super().__init__()
        self._virtual, self._selector = clock, _Waiting(clock)

    def time(self) -> float:
        """See ``asyncio``."""
        return self._virtual.monotonic_s()

    def _write_to_self(self) -> None:
        self._selector.wake.set()

    def _process_events(self, _events: list[object]) -> None:
        pass

    async def in_thread(self, work: Callable[[], T]) -> T:
        """The result of what may wait, from a thread of the process."""
        future: asyncio.Future[T] = self.create_future()

        def tell(result: T | None, problem: BaseException | None) -> None:
            if future.done():  # nobody waits for it any more
                return
            if problem is not None:
                future.set_exception(problem)
            else:
                future.set_result(result)  # type: ignore[arg-type]

        def run() -> None:
            try:
                result = work()
            except Exception as problem:
                self.call_soon_threadsafe(tell, None, problem)
            else:
                self.call_soon_threadsafe(tell, result, None)

        self._virtual.thread("worker", run)
        return await future


_in_system_thread = anyio.to_thread.run_sync


async def _run_sync(work: Callable[..., T], *arguments: Any, **options: Any) -> T:
    """In place of ``anyio.to_thread.run_sync``, whose threads know no virtual time."""
    loop = asyncio.get_running_loop()
    if isinstance(loop, VirtualLoop):
        return await loop.in_thread(partial(work, *arguments))
    return await _in_system_thread(work, *arguments, **options)


class VirtualGateway:
    """The gateway's worker. Implements ``Worker``."""

    def __init__(self, bus: Bus, config: GatewayConfig) -> None:
        anyio.to_thread.run_sync = _run_sync  # type: ignore[assignment]
        self._clock, self.cache = bus.clock, StateCache(bus)
        self._app = create_app(GatewayContext(self.cache, RpcClient(bus), config))
        self._loop = VirtualLoop(bus.clock)
        self._stop = bus.clock.event()
        bus.clock.thread("http", self._serve)

    def step(self, timeout_s: float) -> None:
        """See ``Worker``."""
        self._stop.wait(timeout_s)

    def health(self) -> Health:
        """See ``Worker``."""
        return Health(True, "", {})

    def close(self) -> None:
        """See ``Worker``."""
        self._loop.call_soon_threadsafe(self._loop.stop)
        self.cache.close()

    def _serve(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_forever()

    def request(
        self, clock: Clock, method: str, path: str, body: object = None
    ) -> tuple[int, dict[str, Any]]:
        """Status and document of a request, which ``clock``'s thread waits for.

        Raises ConnectionError where none comes.
        """
        answered, replies = clock.event(), list[tuple[int, dict[str, Any]]]()

        async def run() -> None:
            replies.append(await self._answer(method, path, body))
            answered.set()

        self._loop.call_soon_threadsafe(lambda: self._loop.create_task(run()))
        if not answered.wait(ANSWERS_WITHIN_S):
            raise ConnectionError(f"{method} {path}: no answer")
        return replies[0]

    async def _answer(self, method: str, path: str, body: object) -> tuple[int, dict[str, Any]]:
        data = b"" if body is None else json.dumps(body).encode()
        headers = [(b"host", HOST), (b"content-length", str(len(data)).encode())]
        if body is not None:
            headers.append((b"content-type", b"application/json"))
        scope = {
            "type": "http",
            "asgi": {"version": "3.0"},
            "http_version": "1.1",
            "method": method,
            "scheme": "http",
            "path": path,
            "raw_path": path.encode(),
            "query_string": b"",
            "root_path": "",
            "headers": headers,
            "client": (HOST.decode(), 1),
            "server": (HOST.decode(), 80),
        }
        asked = [{"type": "http.request", "body": data, "more_body": False}]
        sent: list[dict[str, Any]] = []

        async def receive() -> dict[str, Any]:
            if asked:
                return asked.pop()
            await asyncio.Event().wait()  # the client stays
            raise AssertionError

        async def send(message: dict[str, Any]) -> None:
            sent.append(message)

        await self._app(scope, receive, send)  # type: ignore[arg-type]
        document = b"".join(each.get("body", b"") for each in sent[1:])
        return int(sent[0]["status"]), json.loads(document or b"{}")
