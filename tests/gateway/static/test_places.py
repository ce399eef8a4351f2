"""Rooms with names and keep-out zones on the page: drawn, named, forgotten."""

from __future__ import annotations

import pytest

from onemap_shared.messages import PlaceKind
from tests.gateway.static.axe import violations
from tests.gateway.static.chromium import Page
from tests.gateway.static.conftest import (
    PHONE,
    WRITTEN,
    Robot,
    assert_accessible,
    middle_of,
    open_still,
)

pytestmark = pytest.mark.slow

MENU_OPEN = "document.getElementById('place-menu').open"
HINT_SHOWN = "!document.getElementById('zone-hint').hidden"


def open_menu(page: Page, robot: Robot) -> tuple[float, float]:
    """The menu of a place in the room with a suggested name; where that is in the window."""
    open_still(page, robot)
    page.evaluate(WRITTEN)
    x, y = middle_of(page, "free")  # at the border of the room
    place = (x + 40, y - 30)
    page.point(place)  # so that all is drawn again
    page.wait_for("written.has('kitchen?')")  # a suggestion of the mapper's
    page.drag(place, place)
    page.wait_for(MENU_OPEN)
    return place


def test_a_room_is_named_and_its_name_forgotten(page: Page, robot: Robot) -> None:
    place = open_menu(page, robot)
    assert page.evaluate("document.getElementById('place-name').value") == "kitchen"
    page.evaluate("document.getElementById('place-name').value = ''")
    page.click("#place-save")
    page.wait_for(
        "document.querySelector('#place-menu .error').innerText.startsWith('Type a name')"
    )
    page.type("#place-name", "Study")
    page.click("#place-save")
    page.wait_for(f"!{MENU_OPEN} && written.has('Study')")
    named = robot.mapper.named["study"]
    assert named.kind is PlaceKind.ROOM
    assert named.inside_m
    page.drag(place, place)
    page.wait_for("document.getElementById('place-title').innerText.startsWith('Study (')")
    assert page.text("#place-forget") == "Forget Study"
    page.click("#place-forget")
    page.wait_for(f"!{MENU_OPEN}")
    assert not robot.mapper.named
    assert page.errors == []


def test_a_zone_is_drawn_between_two_corners(page: Page, robot: Robot) -> None:
    x, y = open_menu(page, robot)
    page.type("#place-name", "stairs")
    page.click("#place-zone")
    page.wait_for(f"!{MENU_OPEN} && {HINT_SHOWN}")
    assert violations(page) == []
    page.drag((x + 40, y - 30), (x + 40, y - 30))
    page.wait_for("written.has('stairs')")
    assert not page.evaluate(HINT_SHOWN)
    zone = robot.mapper.named["stairs"]
    assert zone.kind is PlaceKind.KEEP_OUT
    across_m, up_m = (max(axis) - min(axis) for axis in zip(*zone.corners_m, strict=True))
    assert across_m / up_m == pytest.approx(40 / 30, rel=0.05)
    assert page.errors == []


def test_a_zone_that_was_begun_can_be_left(page: Page, robot: Robot) -> None:
    page.resize(*PHONE, mobile=True)
    open_menu(page, robot)
    assert_accessible(page)
    page.click("#place-zone")
    page.wait_for(HINT_SHOWN)
    page.click("#zone-cancel")
    page.wait_for(f"!({HINT_SHOWN})")
    assert not robot.mapper.named
