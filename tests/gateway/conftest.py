from __future__ import annotations

from collections.abc import Iterator

import pytest
from starlette.testclient import TestClient

from onemap_shared.memory_bus import MemoryRouter
from tests.gateway.fakes import FakeMapper, FakePlanner, client_on


@pytest.fixture
def hub() -> MemoryRouter:
    return MemoryRouter()


@pytest.fixture
def mapper(hub: MemoryRouter) -> Iterator[FakeMapper]:
    fake = FakeMapper(hub)
    yield fake
    fake.bus.close()


@pytest.fixture
def planner(hub: MemoryRouter) -> Iterator[FakePlanner]:
    fake = FakePlanner(hub)
    yield fake
    fake.bus.close()


@pytest.fixture
def client(hub: MemoryRouter, mapper: FakeMapper, planner: FakePlanner) -> Iterator[TestClient]:
    """A gateway with a mapper and a planner that answer, and no robot."""
    with client_on(hub) as client:
        yield client
