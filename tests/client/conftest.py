"""A client of a real gateway on a real socket, with a mapper and a planner in memory."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from onemap import Client, Retry
from onemap_gateway.config import GatewayConfig
from onemap_gateway.service import build
from tests.gateway.conftest import mapper, planner, router
from tests.memory_bus import MemoryRouter

__all__ = ["mapper", "planner", "router"]  # the fixtures


@pytest.fixture
def url(router: MemoryRouter) -> Iterator[str]:
    """Address of a gateway without services."""
    worker = build(router.bus("gateway"), GatewayConfig(port=0))
    yield f"http://127.0.0.1:{worker.port}"
    worker.close()


@pytest.fixture
def client(url: str) -> Iterator[Client]:
    """A client that waits 0 s before it connects again."""
    with Client(url, retry=Retry(first_s=0.0)) as client:
        yield client
