"""Two robots of one map on the page: both are drawn, and each has its camera and search."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from onemap_gateway.config import GatewayConfig
from onemap_gateway.service import build
from onemap_shared import keys
from tests.gateway import fakes
from tests.gateway.fakes import FakeMapper
from tests.gateway.static.axe import violations
from tests.gateway.static.chromium import Page
from tests.gateway.static.conftest import MIDDLE, Robot
from tests.memory_bus import MemoryRouter

pytestmark = pytest.mark.slow

ROBOTS = {"ada": "site/ada", "bob": "site/bob", "far": "site/far"}
PLACES = {"ada": (1.0, 0.5), "bob": (2.0, 1.4), "far": (1.5, 1.0)}
MAPPERS = {"ada": "m1", "bob": "m1", "far": "m2"}  # the third is at another site


@pytest.fixture
def address() -> Iterator[str]:
    """A gateway of three robots, two of them on one map."""
    router = MemoryRouter()
    bus = router.bus("gateway")
    mappers = []
    for namespace in ROBOTS.values():
        bus.sibling(namespace).close()  # makes the namespace
        mappers.append(FakeMapper(router.namespaces[namespace]))
        mappers[-1].objects = [
            replace(fakes.kept_object("o1", "sofa"), position_m=(1.5, 1.1, 0.4), robot="site/bob")
        ]
    worker = build(bus, GatewayConfig(port=0, robots=ROBOTS))
    for name, namespace in ROBOTS.items():
        robot = router.namespaces[namespace].bus("simulator")
        robot.publish(keys.ROBOT_ODOMETRY).put(fakes.odometry(*PLACES[name]))
        robot.publish(keys.MAP_REVISION).put(fakes.revision(7, objects_version=1))
        beat = fakes.heartbeat("mapper", instance=MAPPERS[name])
        robot.publish(keys.heartbeat("mapper")).put(beat)
    yield f"http://127.0.0.1:{worker.port}"
    worker.close()
    for mapper in mappers:
        mapper.bus.close()


def test_the_robots_of_a_map_stand_on_it_with_a_link_to_each(page: Page, address: str) -> None:
    page.open(address)
    assert page.evaluate("location.pathname") == "/robots/ada/"  # the gateway has none of its own
    page.wait_for("document.querySelectorAll('#robots a').length === 3")
    assert page.text("#robots [aria-current]") == "ada"
    page.wait_for(MIDDLE % "robot-0")
    page.wait_for(MIDDLE % "robot-1")
    assert page.evaluate(MIDDLE % "robot-2") in (0, None), "another site's robot is on this map"
    (left, _), (right, _) = (page.evaluate(MIDDLE % f"robot-{index}") for index in (0, 1))
    assert left < right
    page.wait_for("document.getElementById('finds').innerText.includes('by bob')")
    page.click("#finds button")
    page.wait_for(
        "document.getElementById('find-facts').innerText.includes('by bob · at 1.5, 1.1')"
    )
    page.press("Escape")
    page.open(page.evaluate("document.querySelector('#robots a:nth-of-type(2)').href"))
    page.wait_for("document.querySelector('#robots [aria-current]')?.innerText === 'bob'")
    page.wait_for(MIDDLE % "robot-0")
    assert violations(page) == []
    assert page.errors == []


def test_one_robot_has_no_links(page: Page, robot: Robot) -> None:
    page.open(robot.address)
    assert page.evaluate("document.getElementById('robots').hidden")
