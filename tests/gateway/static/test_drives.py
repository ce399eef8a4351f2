"""Sending the robot to a place of the map: mouse, finger, keyboard, refusals, the search card."""

from __future__ import annotations

import re
import threading
from dataclasses import replace

import pytest
from pydantic import SecretStr

from onemap_gateway.config import GatewayConfig
from onemap_shared.keys import SEARCH_CANCEL, SEARCH_START
from onemap_shared.messages import After, SearchId, SearchRequest, SearchState, SearchStatus
from onemap_shared.transport import RequestRejected
from tests.gateway.static.chromium import Page
from tests.gateway.static.conftest import (
    MIDDLE,
    PHONE,
    WRITTEN,
    Robot,
    assert_accessible,
    middle_of,
    open_still,
    start_search,
)

pytestmark = pytest.mark.slow

ASKED = "document.getElementById('token-dialog')?.open"
MENU_OPEN = "document.getElementById('place-menu').open"


def open_page(page: Page, robot: Robot) -> tuple[float, float]:
    """The page with its map; the middle of the map's floor in the window."""
    open_still(page, robot)
    return middle_of(page, "free")


def named_place(page: Page) -> list[float]:
    """The place in the title of the menu."""
    return [float(number) for number in re.findall(r"-?\d+\.\d", page.text("#place-title"))]


@pytest.mark.parametrize(
    ("button", "kind", "title"),
    [
        ("#place-go", "go_to", "Driving to ({}, {})"),
        ("#place-look", "look_at", "Going to look at ({}, {})"),
    ],
)
def test_a_click_sends_the_robot(
    page: Page, robot: Robot, button: str, kind: str, title: str
) -> None:
    place = open_page(page, robot)
    page.drag(place, place)
    page.wait_for(MENU_OPEN)
    x_m, y_m = named_place(page)
    page.click(button)
    page.wait_for(f"!{MENU_OPEN} && document.body.classList.contains('searching')")
    started, place_m = robot.drive()
    assert started == kind
    assert place_m == pytest.approx((x_m, y_m), abs=0.051)
    wanted = title.format(x_m, y_m)
    page.wait_for(f"document.getElementById('search-title').innerText === '{wanted}'")
    assert page.text("#search-reason").startswith("Looking around")
    assert page.centre("#stop") is not None
    robot.planner.move(SearchState.ARRIVED, "stands at the place")
    page.wait_for("document.getElementById('search-state').innerText === 'arrived'")
    assert page.evaluate("document.getElementById('stop').hidden")
    assert page.errors == []


def test_an_interrupted_search_can_be_started_again(page: Page, robot: Robot) -> None:
    open_page(page, robot)
    start_search(page)
    assert page.evaluate("document.getElementById('again').hidden")
    robot.planner.move(SearchState.INTERRUPTED, "interrupted at 12:00: the planner was stopped")
    page.wait_for("!document.getElementById('again').hidden")
    robot.drives(0.3)  # another program
    page.wait_for("document.getElementById('again').hidden")
    robot.drives(0.0)
    page.wait_for("!document.getElementById('again').hidden")
    page.click("#again")
    page.wait_for("document.body.classList.contains('searching')")
    assert robot.planner.status is not None
    assert robot.planner.status.objects == ("sofa", "kettle")
    assert page.evaluate("document.getElementById('again').hidden")
    assert page.errors == []


def test_the_robot_is_sent_back_to_where_a_search_began(page: Page, robot: Robot) -> None:
    page.open(robot.address)
    start_search(page)
    assert robot.planner.status is not None
    robot.planner.status = replace(robot.planner.status, start_m=(0.5, 0.25))
    robot.planner.move(SearchState.FOUND)
    page.click("#back")
    page.wait_for("document.getElementById('search-title').innerText.startsWith('Driving to')")
    assert robot.drive()[0] == "go_to"
    assert robot.planner.requests[-1].place == "back"
    page.click("#stop")
    page.wait_for("!document.body.classList.contains('searching')")
    page.click("#return")
    start_search(page)
    assert [each.after for each in robot.planner.requests] == [After.STAY, After.STAY, After.RETURN]
    assert page.errors == []


def test_stop_ends_what_runs_now_whatever_the_page_shows(page: Page, robot: Robot) -> None:
    page.open(robot.address)
    start_search(page)
    assert robot.planner.status is not None
    robot.planner.status = replace(robot.planner.status, search_id="s9")  # not told yet
    page.click("#stop")
    page.wait_for("!document.body.classList.contains('searching')")
    assert robot.planner.status.state is SearchState.CANCELLED
    assert page.errors == []


def test_stop_is_in_sight_while_a_start_is_checked(page: Page, robot: Robot) -> None:
    page.open(robot.address)
    released, planner = threading.Event(), robot.planner

    def checked(request: SearchRequest) -> SearchStatus:
        assert released.wait(60.0)
        assert request.age_s > 0.0
        raise RequestRejected("stopped", "the robot was told to stop after this was asked for")

    def stopped(_: SearchId) -> SearchStatus:
        released.set()
        raise RequestRejected("unknown_search", "no search has been started yet")

    planner.bus.serve(SEARCH_START, checked)
    planner.bus.serve(SEARCH_CANCEL, stopped)
    page.type("#text", "sofa")
    page.click("#find")
    page.wait_for("!document.getElementById('stop').hidden")
    assert page.centre("#stop") is not None
    page.click("#stop")
    page.wait_for("document.getElementById('error').innerText.includes('told to stop')")
    assert page.evaluate("document.getElementById('stop').hidden")


def test_a_drag_moves_the_map_and_opens_nothing(page: Page, robot: Robot) -> None:
    place = open_page(page, robot)
    page.drag(place, (place[0] + 80, place[1]))
    page.wait_for(f"{MIDDLE % 'free'}[0] > {place[0] + 40}")
    assert not page.evaluate(MENU_OPEN)


def test_escape_and_a_click_elsewhere_close_the_menu(page: Page, robot: Robot) -> None:
    place = open_page(page, robot)
    page.drag(place, place)
    page.wait_for(MENU_OPEN)
    assert_accessible(page)
    page.press("Escape")
    page.wait_for(f"!{MENU_OPEN}")
    page.drag(place, place, button="right")
    page.wait_for(MENU_OPEN)
    page.click("#text")
    page.wait_for(f"!{MENU_OPEN}")
    assert robot.planner.status is None


def test_the_keyboard_chooses_the_middle_of_the_map(page: Page, robot: Robot) -> None:
    open_page(page, robot)
    page.evaluate("document.getElementById('map').focus({ focusVisible: true })")
    page.press("Enter")
    page.wait_for(MENU_OPEN)
    assert page.evaluate("document.activeElement.id") == "place-go"
    page.press("Enter")
    page.wait_for(f"!{MENU_OPEN}")
    assert robot.drive()[0] == "go_to"


def test_a_finger_sends_the_robot_on_a_phone(page: Page, robot: Robot) -> None:
    page.resize(*PHONE, mobile=True)
    place = open_page(page, robot)
    page.tap(place)
    page.wait_for(MENU_OPEN)
    assert_accessible(page)
    page.click("#place-go")
    page.wait_for("document.body.classList.contains('searching')")
    assert page.centre("#stop") is not None
    page.tap((place[0] - 60, place[1]))  # elsewhere: the same place would be a double tap
    page.wait_for(MENU_OPEN)
    assert page.centre("#stop") is not None, "the menu covers Stop"


def test_the_height_of_what_stands_there_is_told(page: Page, robot: Robot) -> None:
    """Beside the mouse, and in the menu of a place; fetched only then."""
    open_still(page, robot)
    page.evaluate(WRITTEN)
    fetched = "performance.getEntriesByName(origin + '/v1/map/heights.png').length"
    assert page.evaluate(fetched) == 0
    page.point(middle_of(page, "free"))
    page.wait_for(f"{fetched} === 1")
    for colour, words in (("occupied", "about 0.8 m high"), ("wall", "2.1 m high or more")):
        page.point(middle_of(page, colour))
        page.wait_for(f"written.has('{words}')")
    there = middle_of(page, "wall")
    page.drag(there, there)
    page.wait_for(MENU_OPEN)
    page.wait_for("!document.getElementById('place-height').hidden")
    assert page.text("#place-height") == "What stands there is 2.1 m high or more."
    page.press("Escape")
    there = middle_of(page, "free")
    page.drag(there, there)
    page.wait_for(MENU_OPEN)
    assert page.evaluate("document.getElementById('place-height').hidden")
    assert page.evaluate(fetched) == 1
    assert page.errors == []


def test_a_running_search_is_not_replaced(page: Page, robot: Robot) -> None:
    place = open_page(page, robot)
    start_search(page, "sofa")
    page.drag(place, place)
    page.click("#place-go")
    page.wait_for("!document.querySelector('#place-menu .error').hidden")
    assert page.text("#place-menu .error") == (
        "The robot is looking for the sofa: wait until it is done, or press Stop."
    )
    assert robot.drive() == ("find", ())
    page.press("Escape")
    page.drag(place, place)
    page.wait_for(MENU_OPEN)
    assert page.evaluate("document.querySelector('#place-menu .error').hidden")


@pytest.mark.parametrize(
    "gateway_config",
    [GatewayConfig(port=0, token=SecretStr("secret"), look_token=SecretStr("look"))],
)
def test_the_page_asks_for_a_token_until_one_is_right_and_for_another_to_drive(
    page: Page, robot: Robot
) -> None:
    page.open(robot.address, ready=ASKED)
    assert page.evaluate(MIDDLE % "free") == 0
    page.type("#token", "l\u00f6\u0142k")  # of no header
    page.click("#token-dialog .primary")
    said = page.evaluate(f"{ASKED} && document.getElementById('token').validationMessage")
    assert said.startswith("A token has letters, digits and signs of ASCII only")
    page.type("#token", "wrong")
    page.click("#token-dialog .primary")
    page.wait_for(f"{ASKED} && !document.getElementById('token').value")  # asked again
    page.type("#token", " look ")
    page.click("#token-dialog .primary")
    place = middle_of(page, "free")
    page.drag(place, place)
    page.click("#place-go")
    page.wait_for(ASKED)
    page.type("#token", "secret")
    page.click("#token-dialog .primary")
    page.wait_for(f"!{MENU_OPEN} && document.body.classList.contains('searching')")
    assert robot.drive()[0] == "go_to"
