"""The live page says why the robot drives where it drives."""

from __future__ import annotations

from dataclasses import replace

import pytest

from onemap_shared import keys
from onemap_shared.messages import NO_CHOICE, GoalChoice
from tests.gateway import fakes
from tests.gateway.static.chromium import Page
from tests.gateway.static.conftest import PHONE, WRITTEN, Robot, assert_accessible, start_search

pytestmark = pytest.mark.slow

ROWS = """[...document.querySelectorAll("#choice-options tr")].map((row) => [
  row.className, ...[...row.children].map((cell) => cell.innerText.replace("\\n", " | ")),
])"""
HIDDEN = "document.getElementById('choice-card').hidden"


def choose(robot: Robot, choice: GoalChoice) -> None:
    status = robot.planner.status
    assert status is not None
    robot.planner.status = replace(
        status, choice=choice, reason=choice.sentence, updated_ns=status.updated_ns + 1
    )
    robot.router.bus("planner").publish(keys.SEARCH_STATE).put(robot.planner.status)


def test_the_goals_that_were_weighed_are_a_table_and_letters_on_the_map(
    page: Page, robot: Robot
) -> None:
    page.open(robot.address)
    start_search(page)
    assert page.evaluate(HIDDEN)
    page.evaluate(WRITTEN)
    choose(robot, fakes.CHOICE)
    page.wait_for(f"!{HIDDEN}")
    assert page.evaluate(ROWS) == [
        ["chosen", "A frontier | chosen", "0.56", "1.2 m", "0.52"],
        ["", "B region | at 1.5, 1.2", "0.61", "5.0 m", "0.41"],
    ]
    assert (
        page.text("#search-reason")
        == "Going to the unexplored space behind the sofa: it promises most"
    )
    assert page.text("#choice-left-out") == "3 more were weighed."
    page.wait_for("written.has('A') && written.has('B')")
    page.resize(*PHONE, mobile=True)
    assert_accessible(page)
    choose(robot, replace(NO_CHOICE, number=3))
    page.wait_for(HIDDEN)
    assert page.errors == []
