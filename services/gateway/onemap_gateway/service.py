"""The gateway as a service: an HTTP server in a thread of its own, beside the runner's loop."""

from __future__ import annotations

import asyncio
import logging
from functools import partial
from typing import cast

import uvicorn

from onemap_gateway.bus.rpc import RpcClient
from onemap_gateway.bus.state_cache import StateCache
from onemap_gateway.config import TOKENS, GatewayConfig, is_loopback, with_token_file
from onemap_gateway.connections import (
    BACKLOG,
    MAX_CONNECTIONS,
    LimitedConnection,
    connection_limit,
    listen,
)
from onemap_gateway.http.app import create_app
from onemap_gateway.http.context import PACES, GatewayContext, Paces
from onemap_gateway.http.middleware import FleetApp
from onemap_gateway.http.security import MAX_BODY_BYTES
from onemap_shared.transport import Bus, Health
from onemap_shared.watchdog import ThreadCheck

LOG = logging.getLogger("onemap.gateway")

GRACEFUL_SHUTDOWN_S = 1  # open streams end within 0.2 s; connections left are then closed
JOIN_TIMEOUT_S = 1.5

# Fewer can be guessed over the network in years; 16 random characters take longer than the world.
GUESSABLE_CHARS = 16
EVERY_ADDRESS = ("0.0.0.0", "::")


class HttpServer(uvicorn.Server):
    """Counts the turns of its event loop, ten a second."""

    turns = 0

    async def on_tick(self, counter: int) -> bool:
        """See ``uvicorn.Server``; returns whether to end."""
        self.turns += 1
        return await super().on_tick(counter)


class GatewayWorker:
    """Serves HTTP until ``close``."""

    def __init__(self, bus: Bus, config: GatewayConfig, paces: Paces = PACES) -> None:
        listener = listen(config.host, config.port)
        self.port: int = listener.getsockname()[1]
        self._cache = StateCache(bus)
        self._robots = {name: bus.sibling(at) for name, at in config.robots.items()}
        caches = {name: StateCache(at) for name, at in self._robots.items()}
        self._caches = [self._cache, *caches.values()]
        apps = {
            name: create_app(GatewayContext(caches[name], RpcClient(at), config, paces=paces))
            for name, at in self._robots.items()
        }
        rpc = RpcClient(bus)
        own = GatewayContext(self._cache, rpc, config, caches, paces=paces)
        app = create_app(own)
        self._server = HttpServer(
            uvicorn.Config(
                FleetApp(app, apps),
                lifespan="off",
                http=cast("type[asyncio.Protocol]", LimitedConnection),
                log_config=None,  # the runner configures logging
                log_level="error",  # a warning is about bytes that a client sent
                access_log=False,
                backlog=BACKLOG,
                server_header=False,
                proxy_headers=False,  # nothing depends on who a proxy says that it speaks for
                ws_max_size=MAX_BODY_BYTES,  # clients have nothing to say there
                timeout_graceful_shutdown=GRACEFUL_SHUTDOWN_S,
            )
        )
        self._clock = bus.clock
        self._thread = self._clock.thread("http", partial(self._server.run, [listener]))
        self._check_server = ThreadCheck("the HTTP server")
        if (limit := connection_limit()) < MAX_CONNECTIONS:
            LOG.warning("only %d connections at once: 'ulimit -n' allows few open files", limit)
        host = f"[{config.host}]" if ":" in config.host else config.host
        if config.host in EVERY_ADDRESS:  # no address to open in a browser
            LOG.info("the page is at port %d of every address of this host", self.port)
        else:
            LOG.info("the page is at http://%s:%d", host, self.port)

    def step(self, timeout_s: float) -> None:
        """Wait; raise if the server's thread has ended or stands still."""
        self._thread.join(timeout_s)
        if not self._thread.is_alive():
            raise RuntimeError("the HTTP server ended by itself")
        self._check_server(self._server.turns, self._clock.monotonic_s())

    def health(self) -> Health:
        """Ready once requests are served; metrics count the messages of each stream."""
        metrics = {
            f"{stream}_{outcome}": float(getattr(counters, outcome))
            for stream, counters in self._cache.counters().items()
            for outcome in ("received", "missed", "skipped", "refused")
        }
        ready = self._server.started
        return Health(ready, "" if ready else "the HTTP server is starting", metrics)

    def close(self) -> None:
        """Stop within two seconds, open streams included."""
        for cache in self._caches:
            cache.begin_close()
        self._server.should_exit = True
        self._thread.join(JOIN_TIMEOUT_S)
        self._server.force_exit = True
        self._thread.join(0.5)
        for cache in self._caches:
            cache.close()
        for robot in self._robots.values():
            robot.close()


def build(bus: Bus, config: GatewayConfig) -> GatewayWorker:
    """A gateway that listens on the configured address."""
    config = with_token_file(config)
    for role, token in config.tokens().items():
        if 0 < len(token) < GUESSABLE_CHARS and not is_loopback(config.host):
            LOG.warning(
                "'gateway.%s' has %d characters and can be guessed: openssl rand -hex 32 makes one "
                "that cannot",
                TOKENS[role],
                len(token),
            )
    return GatewayWorker(bus, config)
