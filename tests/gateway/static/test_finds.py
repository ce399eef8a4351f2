"""Finds on the page: pins, list, card with the photograph, what it offers."""

from __future__ import annotations

import pytest

from tests.gateway.static.axe import violations
from tests.gateway.static.chromium import Page
from tests.gateway.static.conftest import PHONE, Robot, assert_accessible, middle_of, open_still

pytestmark = pytest.mark.slow

CARD_OPEN = "document.getElementById('find-card').open"
PHOTO_SHOWN = "document.getElementById('find-photo').naturalWidth === 320"
# Starts a search as another client does.
SEARCH_ELSEWHERE = """fetch("/v1/searches", {
  method: "POST",
  headers: { "Content-Type": "application/json" },
  body: JSON.stringify({ objects: ["kettle"] }),
}).then((response) => response.status)"""
# Left, top, right and bottom of the box, in pixels of the photograph.
BOX = """(() => {
  const photo = document.getElementById("find-photo").getBoundingClientRect();
  const box = document.getElementById("find-box").getBoundingClientRect();
  const [x0, y0, zoom] = [photo.left, photo.top, 320 / photo.width];
  return [box.left - x0, box.top - y0, box.right - x0, box.bottom - y0].map((px) => px * zoom);
})()"""


def open_with_a_sofa(page: Page, robot: Robot) -> None:
    """The page with one find, near the robot."""
    robot.keep("sofa", 0.4, 1.1)
    open_still(page, robot)
    page.wait_for("document.querySelectorAll('#finds li').length === 1")
    page.evaluate("document.getElementById('finds-card').open = true")  # a phone begins folded


def open_card(page: Page) -> None:
    page.click("#finds button")
    page.wait_for(CARD_OPEN)


def test_a_click_on_a_pin_shows_its_photograph(page: Page, robot: Robot) -> None:
    open_with_a_sofa(page, robot)
    pin = middle_of(page, "find")
    page.drag(pin, pin)
    page.wait_for(f"{CARD_OPEN} && {PHOTO_SHOWN}")
    card = page.text("#find-card")
    for part in ("sofa", "score 0.93", "2026", "0.4, 1.1 m", "Drive there", "Look at it", "Forget"):
        assert part in card
    page.wait_for("!document.getElementById('find-box').hidden")
    assert_accessible(page)
    assert page.evaluate(BOX) == pytest.approx([64, 60, 208, 180], abs=2)
    assert not page.evaluate("document.getElementById('place-menu').open")
    assert page.errors == []


@pytest.mark.parametrize("size", [PHONE, (844, 390)])
def test_the_card_leaves_stop_free_on_a_phone(
    page: Page, robot: Robot, size: tuple[int, int]
) -> None:
    page.resize(*size, mobile=True)
    open_with_a_sofa(page, robot)
    open_card(page)
    page.wait_for(PHOTO_SHOWN)
    assert_accessible(page)
    page.evaluate(SEARCH_ELSEWHERE)
    page.wait_for("document.body.classList.contains('searching')")
    assert page.centre("#stop") is not None, "the search began under an open card"
    page.evaluate("document.getElementById('find-go').click()")  # refused
    page.wait_for("!document.querySelector('#find-card .error').hidden")
    assert page.centre("#stop") is not None, "with an error in the card"
    page.click("#find-card .close")
    open_card(page)
    assert page.centre("#stop") is not None, "the card was opened during a search"
    page.click("#stop")
    page.wait_for("document.getElementById('search-state').innerText === 'cancelled'")


def test_the_keyboard_opens_a_find_from_the_list(page: Page, robot: Robot) -> None:
    open_with_a_sofa(page, robot)
    assert "sofa" in page.text("#finds")
    assert "0.4, 1.1 m, seen 1 Jan" in page.text("#finds")
    for key in ("Enter", " "):
        page.evaluate("document.querySelector('#finds button').focus()")
        page.press(key)
        page.wait_for(CARD_OPEN)
        assert page.evaluate("document.activeElement.id") == "find-go"
        page.press("Escape")
        page.wait_for(f"!{CARD_OPEN}")
        assert page.evaluate("document.activeElement.closest('#finds') !== null")


def test_a_find_is_told_by_its_room(page: Page, robot: Robot) -> None:
    page.open(robot.address)
    robot.keep("kettle", 1.5, 1.0)
    page.wait_for(
        "document.querySelector('#finds small')?.innerText.startsWith('In the kitchen, at 1.5')"
    )
    page.click("#finds button")
    page.wait_for(
        "document.getElementById('find-facts').innerText.startsWith('In the kitchen · seen')"
    )
    assert page.errors == []


def test_a_new_find_appears_and_a_forgotten_one_goes(page: Page, robot: Robot) -> None:
    open_still(page, robot)
    assert page.evaluate("document.getElementById('finds-card').hidden")
    robot.keep("sofa", 0.4, 1.1)
    page.wait_for("document.querySelectorAll('#finds li').length === 1")
    open_card(page)
    page.wait_for(PHOTO_SHOWN)  # asked for later, it would be gone: an error of the console
    page.click("#find-forget")
    page.click("#forget-yes")
    page.wait_for(f"!{CARD_OPEN}")
    robot.show_finds(*robot.mapper.objects)
    page.wait_for("document.getElementById('finds-card').hidden")
    assert page.errors == []


def test_a_find_is_forgotten_only_after_a_second_answer(page: Page, robot: Robot) -> None:
    open_with_a_sofa(page, robot)
    open_card(page)
    page.click("#find-forget")
    assert page.text("#find-question") == "Forget the sofa?"
    assert violations(page) == []
    page.click("#forget-no")
    assert not page.evaluate("document.getElementById('find-question').checkVisibility()")
    assert len(robot.mapper.objects) == 1
    page.click("#find-forget")
    page.press("Escape")
    page.wait_for(f"!{CARD_OPEN}")
    open_card(page)
    assert page.centre("#find-go") is not None, "the card opens without the question"
    assert len(robot.mapper.objects) == 1


@pytest.mark.parametrize(("button", "kind"), [("#find-go", "go_to"), ("#find-look", "look_at")])
def test_the_robot_is_sent_to_a_find(page: Page, robot: Robot, button: str, kind: str) -> None:
    open_with_a_sofa(page, robot)
    open_card(page)
    page.click(button)
    page.wait_for(f"!{CARD_OPEN}")
    assert robot.drive() == (kind, (0.4, 1.1))
