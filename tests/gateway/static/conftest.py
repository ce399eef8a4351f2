from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from onemap_gateway.config import GatewayConfig
from onemap_gateway.service import build
from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import SearchState
from tests.gateway import fakes
from tests.gateway.fakes import FakeMapper, FakePlanner
from tests.gateway.static.chromium import COMMAND, Chromium, Page, running_chromium

PHONE = (360, 640)


@dataclass
class Robot:
    """What the page shows: a robot, a mapper and a planner that answer, a gateway's address."""

    address: str
    planner: FakePlanner
    router: MemoryRouter

    def move(self) -> None:
        """Publish a pose, a path and a revision of the map."""
        bus = self.router.bus("simulator")
        bus.publish(keys.ROBOT_RGBD).put(fakes.rgbd())
        bus.publish(keys.ROBOT_ODOMETRY).put(fakes.odometry(1.0, 0.5, 0.4))
        bus.publish(keys.MAP_REVISION).put(fakes.revision(7))
        bus.publish(keys.SEARCH_PATH).put(fakes.planned_path((1.0, 0.5), (1.8, 0.9)))

    def find(self, name: str, x_m: float, y_m: float) -> None:
        """End the search with a find."""
        assert self.planner.status is not None
        found = (fakes.find_result(name, x_m, y_m),)
        self.planner.status = replace(self.planner.status, results=found)
        self.planner.move(SearchState.FOUND, f"found the {name}")


def start_search(page: Page, text: str = "sofa, kettle") -> None:
    page.type("#text", text)
    page.click("#find")
    page.wait_for("document.body.classList.contains('searching')")


@pytest.fixture(scope="session")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chromium]:
    if not COMMAND:
        pytest.skip("chromium is not installed (Debian package chromium)")
    folder: Path = tmp_path_factory.mktemp("chromium")
    with running_chromium(folder) as chromium:
        yield chromium


@pytest.fixture
def page(chromium: Chromium) -> Iterator[Page]:
    with chromium.page() as page:
        page.prefer("dark")
        page.resize(1280, 800)
        yield page


@pytest.fixture
def robot(router: MemoryRouter, mapper: FakeMapper, planner: FakePlanner) -> Iterator[Robot]:
    mapper.vocabulary = frozenset({"sofa", "kettle", "kite"})
    worker = build(router.bus("gateway"), GatewayConfig(port=0, live_rate_hz=20))
    robot = Robot(f"http://127.0.0.1:{worker.port}/", planner, router)
    robot.move()
    yield robot
    worker.close()
