from __future__ import annotations

from collections.abc import Iterator

import pytest
from starlette.testclient import TestClient

from tests.gateway.fakes import FakeMapper, FakePlanner, client_on
from tests.memory_bus import MemoryRouter


@pytest.fixture
def router() -> MemoryRouter:
    return MemoryRouter()


@pytest.fixture(autouse=True)
def _wrong_tokens_are_answered_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("onemap_gateway.http.security.WRONG_TOKEN_S", 0.0)


@pytest.fixture
def mapper(router: MemoryRouter) -> Iterator[FakeMapper]:
    fake = FakeMapper(router)
    yield fake
    fake.bus.close()


@pytest.fixture
def planner(router: MemoryRouter) -> Iterator[FakePlanner]:
    fake = FakePlanner(router)
    yield fake
    fake.bus.close()


@pytest.fixture
def client(router: MemoryRouter, mapper: FakeMapper, planner: FakePlanner) -> Iterator[TestClient]:
    """A gateway with a mapper and a planner that answer, and no robot."""
    with client_on(router) as client:
        yield client
