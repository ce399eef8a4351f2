"""A TCP proxy that delivers every byte later, as a slow wireless network does."""

from __future__ import annotations

import socket
import threading
import time
from collections import deque
from contextlib import suppress

CHUNK_BYTES = 64 * 1024
WAIT_S = 0.2  # between two looks whether to stop


class DelayingProxy:
    """Passes connections on to ``target``; ``delay_s`` each way may change at any time."""

    def __init__(self, target: tuple[str, int]) -> None:
        self.delay_s = 0.0
        self._target = target
        self._closing = threading.Event()
        self._server = socket.create_server(("127.0.0.1", 0))
        self._sockets: list[socket.socket] = [self._server]
        self._spawn(self._accept)

    @property
    def endpoint(self) -> str:
        """Where to connect instead of the target, for Zenoh."""
        host, port = self._server.getsockname()
        return f"tcp/{host}:{port}"

    def close(self) -> None:
        """Cut all connections."""
        self._closing.set()
        for each in self._sockets:
            with suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while not self._closing.is_set():
                near, _ = self._server.accept()
                far = socket.create_connection(self._target)
                self._sockets += [near, far]
                _Pipe(self, near, far)
                _Pipe(self, far, near)

    def _spawn(self, run: object) -> None:
        threading.Thread(target=run, daemon=True).start()  # type: ignore[arg-type]


class _Pipe:
    """One way of one connection: a thread reads, another writes what is due."""

    def __init__(self, proxy: DelayingProxy, source: socket.socket, sink: socket.socket) -> None:
        self._proxy, self._source, self._sink = proxy, source, sink
        self._under_way: deque[tuple[float, bytes]] = deque()
        self._changed = threading.Condition()
        proxy._spawn(self._read)
        proxy._spawn(self._write)

    def _read(self) -> None:
        data = b"?"
        with suppress(OSError):
            while data:
                data = self._source.recv(CHUNK_BYTES)
                with self._changed:
                    due_s = time.monotonic() + self._proxy.delay_s
                    self._under_way.append((due_s, data))
                    self._changed.notify()

    def _write(self) -> None:
        with suppress(OSError):
            while not self._proxy._closing.is_set():
                data = self._due()
                if data == b"":
                    self._sink.shutdown(socket.SHUT_WR)
                    return
                if data is not None:
                    self._sink.sendall(data)

    def _due(self) -> bytes | None:
        """The next bytes if they are due, else None after a wait for them."""
        with self._changed:
            if not self._under_way:
                self._changed.wait(WAIT_S)
                return None
            left_s = self._under_way[0][0] - time.monotonic()
            if left_s <= 0:
                return self._under_way.popleft()[1]
            self._changed.wait(min(left_s, WAIT_S))
            return None
