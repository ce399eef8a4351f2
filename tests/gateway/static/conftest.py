from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from onemap_gateway.config import GatewayConfig
from onemap_gateway.http.context import Paces
from onemap_gateway.service import GatewayWorker
from onemap_shared import keys
from onemap_shared.messages import KeptObject
from tests.gateway import fakes
from tests.gateway.fakes import FakePlanner, NamingMapper
from tests.gateway.static.axe import violations
from tests.gateway.static.chromium import COMMAND, WAIT_S, Chromium, Page, running_chromium
from tests.memory_bus import MemoryRouter

PHONE = (360, 640)


def photograph() -> bytes:
    """A JPEG of 320 x 240 pixels."""
    image = np.full((240, 320, 3), 120, np.uint8)
    image[60:180, 64:208] = (40, 90, 200)
    return bytes(cv2.imencode(".jpg", image)[1])


@dataclass
class Robot:
    """What the page shows: a robot, a mapper and a planner that answer, a gateway's address."""

    address: str
    mapper: NamingMapper
    planner: FakePlanner
    router: MemoryRouter
    _version: int = 4

    def move(self) -> None:
        """Publish a pose, a path and a revision of the map."""
        bus = self.router.bus("simulator")
        bus.publish(keys.ROBOT_RGBD).put(fakes.rgbd())
        self.drives(0.0)
        bus.publish(keys.MAP_REVISION).put(fakes.revision(7))
        bus.publish(keys.SEARCH_PATH).put(fakes.planned_path((1.0, 0.5), (1.8, 0.9)))

    def drives(self, linear_mps: float) -> None:
        """Publish a pose of the robot with this speed."""
        pose = replace(fakes.odometry(1.0, 0.5, 0.4), linear_mps=linear_mps)
        self.router.bus("simulator").publish(keys.ROBOT_ODOMETRY).put(pose)

    def drive(self) -> tuple[str, tuple[float, ...]]:
        """Kind and place of what the planner was asked for."""
        assert self.planner.status is not None
        return self.planner.status.kind, self.planner.status.place_m

    def keep(self, name: str, x_m: float, y_m: float, **changes: Any) -> None:
        """Let the mapper keep a find; without ``picture_bytes`` it has no photograph."""
        count = len(self.mapper.objects)
        kept = replace(
            fakes.kept_object(f"o{count}", name),
            position_m=(x_m, y_m, 0.4),
            box_px=(64.0, 60.0, 208.0, 180.0),
            **changes,
        )
        self.show_finds(kept, *self.mapper.objects)

    def show_finds(self, *finds: KeptObject) -> None:
        """Let the mapper keep these finds only."""
        self.mapper.objects = list(finds)
        self._version += 1
        revision = fakes.revision(7, objects_version=self._version)
        self.router.bus("mapper").publish(keys.MAP_REVISION).put(revision)


# The middle of all pixels of one colour on the map, in the window; null if there are none.
MIDDLE = """(() => {
  const canvas = document.getElementById("map");
  const style = getComputedStyle(document.documentElement);
  const hex = style.getPropertyValue("--map-%s").trim();
  const [r, g, b] = [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
  const { data, width } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const box = canvas.getBoundingClientRect();
  let [x, y, count] = [0, 0, 0];
  for (let i = 0; i < data.length; i += 4) {
    const off = Math.abs(data[i] - r) + Math.abs(data[i + 1] - g) + Math.abs(data[i + 2] - b);
    if (off > 11) continue;
    x += (i / 4) %% width;
    y += Math.floor(i / 4 / width);
    count += 1;
  }
  return count && [box.x + x / count, box.y + y / count];
})()"""


# Keeps in `written` every text that is written on a canvas from now on.
WRITTEN = """window.written = new Set();
  const { fillText } = CanvasRenderingContext2D.prototype;
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
    written.add(text);
    fillText.call(this, text, x, y);
  };"""


def middle_of(page: Page, colour: str) -> tuple[float, float]:
    """Where the map shows a colour of style.css."""
    page.wait_for(MIDDLE % colour)
    x, y = page.evaluate(MIDDLE % colour)
    return (x, y)


def open_still(page: Page, robot: Robot) -> None:
    """Open the page and wait until its map stands still."""
    page.open(robot.address)
    page.wait_for(MIDDLE % "free")  # the image of the map is there, and fitted


def assert_accessible(page: Page) -> None:
    """What the page shows now violates nothing, dark and light, and fits into its width."""
    for scheme in ("light", "dark"):
        page.prefer(scheme)
        assert violations(page) == [], scheme
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


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
def mapper(router: MemoryRouter) -> Iterator[NamingMapper]:
    fake = NamingMapper(router)
    yield fake
    fake.bus.close()


@pytest.fixture
def gateway_config() -> GatewayConfig:
    return GatewayConfig(port=0)


@pytest.fixture
def robot(
    router: MemoryRouter, mapper: NamingMapper, planner: FakePlanner, gateway_config: GatewayConfig
) -> Iterator[Robot]:
    mapper.vocabulary = frozenset({"sofa", "kettle", "kite"})
    mapper.picture = photograph()
    patient = Paces(call_timeout_s=WAIT_S)  # what a test holds back fails by no time limit
    worker = GatewayWorker(router.bus("gateway"), gateway_config, patient)
    robot = Robot(f"http://127.0.0.1:{worker.port}/", mapper, planner, router)
    robot.move()
    yield robot
    worker.close()
