"""What was: past searches and their replay on the map; saved maps."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pydantic import SecretStr

from onemap_gateway.config import GatewayConfig
from onemap_shared.messages import SearchState
from tests.gateway.fakes import past_search
from tests.gateway.static.axe import violations
from tests.gateway.static.chromium import Page
from tests.gateway.static.conftest import Robot, middle_of, open_still
from tests.gateway.static.test_finds import SEARCH_ELSEWHERE
from tests.gateway.static.test_page import NEXT_PICTURE

pytestmark = pytest.mark.slow

PHONE = (390, 844)
REPLAYING = "document.body.classList.contains('replaying')"
PICTURED = """(() => {
  const canvas = document.querySelector("#history canvas");
  return canvas?.getContext("2d").getImageData(48, 48, 1, 1).data[3] === 255;
})()"""
ROWS = "document.querySelectorAll('#%s > li').length === %d"


def open_history(page: Page, robot: Robot) -> None:
    """The page with two past searches, the newer one with a photograph of its find."""
    lost = replace(past_search("s9"), state=SearchState.NOT_FOUND, reason="not found", results=())
    robot.planner.past = [past_search(), lost]
    robot.keep("sofa", 1.0, 1.0, search_id="s0")
    open_still(page, robot)
    page.click("#history-card summary")
    page.wait_for(ROWS % ("history", 2))


def open_maps(page: Page, robot: Robot, *saved: str) -> None:
    robot.mapper.saved = list(saved)
    open_still(page, robot)
    page.click("#maps-card summary")
    page.wait_for(ROWS % ("maps", len(saved)))


def answered(page: Page, button: str, text: str) -> None:
    """Answer the question of the maps, and wait for what the page says then."""
    page.click(button)
    page.wait_for(f"document.getElementById('map-done').innerText.includes('{text}')")


def test_a_past_search_is_replayed_until_one_press_returns(page: Page, robot: Robot) -> None:
    open_history(page, robot)
    page.wait_for("document.querySelector('#history canvas')")
    page.evaluate("document.querySelector('#history canvas').scrollIntoView()")
    page.wait_for(PICTURED)
    row = page.text("#history button")
    for part in ("Search for sofa", "found", "10 s", "2.0 m", "Found 1 of 1"):
        assert part in row
    now = middle_of(page, "robot")
    page.click("#history button")
    page.wait_for(REPLAYING)
    assert page.evaluate("document.activeElement.id") == "replay-play"
    assert "Looking around for a sofa." in page.text("#replay")
    assert "frontier at 1.2, 1.2 m." in page.text("#replay-goal")
    assert "4 of its steps are left out" in page.text("#replay")
    began = middle_of(page, "robot")
    page.click("#replay-after")
    assert page.text("#replay-clock") == "6 s of 10 s"
    assert "Walking up to what looks like a sofa" in page.text("#replay-reason")
    page.evaluate(NEXT_PICTURE)
    there = middle_of(page, "robot")
    assert there[0] > began[0] + 50, "it drove to the right"
    assert there[1] == pytest.approx(began[1], abs=3)
    assert violations(page) == []
    page.drag(there, there)  # a press on the map of then sends no robot
    assert not page.evaluate("document.getElementById('place-menu').open")
    page.evaluate("document.getElementById('replay-play').focus()")
    page.press("Enter")
    page.wait_for("document.getElementById('replay-state').innerText === 'found'")  # at its end
    page.wait_for("document.getElementById('replay-play').innerText === 'Play'")
    page.click("#replay-live")
    page.wait_for(f"!{REPLAYING}")
    assert page.evaluate("document.activeElement.closest('#history') !== null")
    page.evaluate(NEXT_PICTURE)
    assert middle_of(page, "robot") == pytest.approx(now, abs=3)
    robot.planner.past.clear()
    page.evaluate("document.querySelector('#history button').click()")
    page.wait_for("!document.getElementById('history-error').hidden")
    assert "No search 's0'" in page.text("#history-error")
    assert not page.evaluate(REPLAYING)


def test_the_replay_on_a_phone_leaves_stop_free(page: Page, robot: Robot) -> None:
    page.prefer("light")
    page.resize(*PHONE, mobile=True)
    open_history(page, robot)
    page.click("#history button")
    page.wait_for(REPLAYING)
    for button in ("before", "play", "after", "live", "time"):
        assert page.centre(f"#replay-{button}") is not None, button
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE[0]
    assert violations(page) == []
    page.evaluate(SEARCH_ELSEWHERE)
    page.wait_for("document.body.classList.contains('searching')")
    assert page.centre("#stop") is not None
    assert page.centre("#replay-live") is not None
    page.click("#replay-tag")
    page.wait_for(f"!{REPLAYING}")
    page.click("#history button")
    page.wait_for(REPLAYING)
    page.evaluate("document.querySelector('#finds button').click()")  # of what is there now
    page.wait_for(f"!{REPLAYING} && document.getElementById('find-card').open")
    assert page.errors == []


def test_maps_are_saved_loaded_merged_deleted_and_cleared(page: Page, robot: Robot) -> None:
    mapper = robot.mapper
    page.prefer("light")
    page.resize(*PHONE, mobile=True)
    open_maps(page, robot)
    page.wait_for("document.getElementById('maps-none').checkVisibility()")
    page.type("#map-name", "../flat")
    page.click("#map-save-button")
    assert "a letter or a digit first" in page.text("#maps-error")
    page.type("#map-name", "flat")
    page.press("Enter")
    page.wait_for(ROWS % ("maps", 1))
    assert mapper.saved == ["flat"]
    assert "flat is saved, 3 kB." in page.text("#map-done")
    page.type("#map-name", "flat")
    page.press("Enter")
    page.wait_for("document.getElementById('map-question').innerText.includes('replace it?')")
    assert page.evaluate("document.activeElement.id") == "map-no"
    answered(page, "#map-yes", "flat is saved")
    for verb, button, says in (
        ("load", 1, "flat is the map in use."),
        ("merge", 2, "flat is merged."),
        ("delete", 3, "flat is deleted."),
    ):
        page.evaluate("document.querySelector('#maps details').open = true")
        page.click(f"#maps .row button:nth-child({button})")
        assert verb in page.text("#map-question").lower()
        assert violations(page) == [], verb
        answered(page, "#map-yes", says)
    assert (mapper.loaded, [each.name for each in mapper.merged], mapper.saved) == (
        ["flat"],
        ["flat"],
        [],
    )
    page.evaluate(SEARCH_ELSEWHERE)
    page.wait_for("document.body.classList.contains('searching')")
    page.click("#map-clear")
    question = page.text("#map-question")
    assert "Its 100 cells and 0 found objects" in question
    assert "The search goes on and looks around anew." in question
    assert page.centre("#stop") is not None
    page.press("Enter")  # the answer that changes nothing has the focus
    assert page.evaluate("document.activeElement.id") == "map-clear"
    assert mapper.cleared == 0
    page.click("#map-clear")
    answered(page, "#map-yes", "The map was cleared")
    assert mapper.cleared == 1
    assert page.errors == []


def test_what_the_mapper_refuses_is_said_in_place(page: Page, robot: Robot) -> None:
    open_maps(page, robot, "flat")
    robot.mapper.saved.clear()  # by another client
    page.click("#maps summary")
    page.click("#maps .row button")
    page.click("#map-yes")
    page.wait_for("!document.getElementById('maps-error').hidden")
    assert "there is no map 'flat'" in page.text("#maps-error").lower()


@pytest.mark.parametrize(
    "gateway_config", [GatewayConfig(port=0, token=SecretStr("s"), look_token=SecretStr("look"))]
)
def test_who_may_only_look_sees_no_button_of_the_maps(page: Page, robot: Robot) -> None:
    robot.mapper.saved = ["flat"]
    page.open(robot.address, "document.getElementById('token-dialog')?.open")
    page.type("#token", "look")
    page.click("#token-dialog .primary")
    page.wait_for("document.querySelector('#maps-card.locked')")
    page.click("#maps-card summary")
    page.wait_for(ROWS % ("maps", 1))
    page.click("#maps summary")
    assert "This token may not change maps" in page.text("#maps-card")
    seen = "[...document.querySelectorAll('#maps-card button')].filter((b) => b.checkVisibility())"
    assert page.evaluate(f"{seen}.length") == 0
    assert violations(page) == []
