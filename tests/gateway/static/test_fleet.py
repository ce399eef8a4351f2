"""The page of one robot and of two on one map: layout, names, finders, a link to each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import pytest

from onemap_gateway.config import GatewayConfig
from onemap_gateway.service import build
from onemap_shared import keys
from onemap_shared.messages import SearchState
from tests.gateway import fakes
from tests.gateway.fakes import FakePlanner, NamingMapper
from tests.gateway.static.axe import violations
from tests.gateway.static.chromium import Page
from tests.gateway.static.conftest import MIDDLE, WRITTEN, Robot
from tests.memory_bus import MemoryRouter

pytestmark = pytest.mark.slow

ROBOTS = {"ada": "site/ada", "bob": "site/bob", "far": "site/far"}
PLACES = {"ada": (1.0, 0.5), "bob": (2.0, 1.4), "far": (1.5, 1.0)}
MAPPERS = {"ada": "m1", "bob": "m1", "far": "m2"}  # the third is at another site


@dataclass(frozen=True)
class Fleet:
    """Where a gateway of three robots is, two of them on one map, and the first one's planner."""

    address: str
    planner: FakePlanner


@pytest.fixture
def fleet() -> Iterator[Fleet]:
    router = MemoryRouter()
    bus = router.bus("gateway")
    mappers = []
    for namespace in ROBOTS.values():
        bus.sibling(namespace).close()  # makes the namespace
        mappers.append(NamingMapper(router.namespaces[namespace]))
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
        robot.publish(keys.ROBOT_RGBD).put(fakes.rgbd())
    planner = FakePlanner(router.namespaces[ROBOTS["ada"]])
    yield Fleet(f"http://127.0.0.1:{worker.port}", planner)
    planner.bus.close()
    worker.close()
    for mapper in mappers:
        mapper.bus.close()


def test_the_robots_of_a_map_stand_on_it_with_a_link_to_each(page: Page, fleet: Fleet) -> None:
    page.open(fleet.address)
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


# Where an element is, in the window: left, top, right, bottom.
BOX = """(() => {
  const { left, top, right, bottom } = document.querySelector("%s").getBoundingClientRect();
  return [left, top, right, bottom];
})()"""
SCROLLS = "document.documentElement.scrollWidth > innerWidth"


@pytest.mark.parametrize(
    ("size", "shown"), [((1280, 800), "fleet"), ((390, 844), "fleet"), ((390, 844), "robot")]
)
def test_one_tap_finds_and_all_of_it_is_in_sight(
    page: Page, size: tuple[int, int], shown: str, request: pytest.FixtureRequest
) -> None:
    """At the start, during the search, and at its end, on every screen and for any robots."""
    at: Robot | Fleet = request.getfixturevalue(shown)
    width, height = size
    page.resize(width, height, mobile=width < 861)
    page.open(at.address)
    page.wait_for(MIDDLE % "free")
    page.evaluate(WRITTEN)
    assert page.evaluate("document.getElementById('legend').open") is False
    assert page.evaluate(SCROLLS) is False
    place = page.centre("#suggestions [aria-label='Go and find: sofa']")
    assert place is not None
    if width < 861:
        page.tap(place)
    else:
        page.drag(place, place)
    page.wait_for("document.body.classList.contains('searching')")
    assert at.planner.status is not None
    assert at.planner.status.objects == ("sofa",)
    page.wait_for("document.getElementById('camera-numbers').innerText.startsWith('Camera')")
    (left, top, right, bottom), stop = page.evaluate(BOX % "#camera"), page.evaluate(BOX % "#stop")
    assert min(left, top) >= 0
    assert (right <= width, bottom <= height) == (True, True)
    map_box = page.evaluate(BOX % "#map")
    assert left >= map_box[2] or top >= map_box[3], "the camera lies over the map"
    assert bottom <= stop[1] or stop[3] <= top, "Stop lies over the camera"
    assert page.centre("#stop") is not None
    assert page.centre("#suggestions") is None, "a second search would be refused"
    assert page.evaluate(SCROLLS) is False
    robots = {"ada", "bob"} if shown == "fleet" else set()
    for name in robots:
        page.wait_for(f"written.has('{name}')")
    assert page.evaluate("document.getElementById('robots').hidden") is not bool(robots)
    at.planner.move(SearchState.FOUND, "found 1 of 1")
    page.wait_for("document.getElementById('search-state').innerText === 'found'")
    assert page.centre("#search-state") is not None
    assert page.evaluate(SCROLLS) is False
    assert page.errors == []
