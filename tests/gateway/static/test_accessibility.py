"""Whether everybody can use the pages: axe-core's rules, contrasts over the map, names."""

from __future__ import annotations

import pytest

from tests.gateway.static.axe import violations
from tests.gateway.static.chromium import Page
from tests.gateway.static.conftest import PHONE, Robot, start_search

pytestmark = pytest.mark.slow

# To axe-core contrasts depend on the scheme, and the size of targets on that of the window.
EACH_LOOK = pytest.mark.parametrize(
    ("scheme", "size"), [("dark", (1280, 800)), ("light", PHONE)], ids=["dark desk", "light phone"]
)
# Texts whose contrast with what is behind them is under that of WCAG 2.2 AA; axe-core does not
# judge those that lie over the map.
FAINT_TEXTS = """(() => {
  const parse = (text) => (text.match(/[\\d.]+/g) ?? [0, 0, 0, 0]).map(Number);
  const over = ([r, g, b, a = 1], below) => [r, g, b].map((c, i) => c * a + below[i] * (1 - a));
  const behind = (node) => {
    if (!node) return [255, 255, 255];
    return over(parse(getComputedStyle(node).backgroundColor), behind(node.parentElement));
  };
  const luminance = (colour) => colour
    .map((c) => c / 255)
    .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4))
    .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
  const faint = [];
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const node = texts.currentNode.parentElement;
    if (!texts.currentNode.data.trim() || !node.checkVisibility()) continue;
    const ground = behind(node);
    const ink = over(parse(getComputedStyle(node).color), ground);
    const [low, high] = [luminance(ink), luminance(ground)].sort((a, b) => a - b);
    const contrast = (high + 0.05) / (low + 0.05);
    if (contrast < 4.5) faint.push(`${texts.currentNode.data.trim()}: ${contrast.toFixed(2)}`);
  }
  return faint;
})()"""


@EACH_LOOK
def test_axe_finds_no_violation_on_the_page(
    page: Page, robot: Robot, scheme: str, size: tuple[int, int]
) -> None:
    page.prefer(scheme)
    page.resize(*size)
    page.open(robot.address)
    page.evaluate("document.getElementById('legend').open = true")
    assert violations(page) == [], "at the start"
    start_search(page)
    page.type("#text", "sofa, kite, flurb")
    page.click("#where")
    page.wait_for("document.querySelectorAll('#regions-card h2').length === 3")
    page.wait_for("document.querySelectorAll('#notices li').length > 0")
    assert violations(page) == [], "with answers and a search that runs"
    for each in ("dark", "light", scheme):
        page.prefer(each)
        assert page.evaluate(FAINT_TEXTS) == [], each
    ids = "[...document.querySelectorAll('[id]')].map((node) => node.id)"
    assert page.evaluate(f"new Set({ids}).size === {ids}.length")
    assert page.evaluate("document.querySelectorAll('h1').length") == 1
    assert page.evaluate("document.getElementById('map').ariaLabel"), "no rule of axe-core's"
    page.click("#stop")
    page.wait_for("document.getElementById('search-state').innerText === 'cancelled'")
    page.type("#text", "")
    page.click("#find")
    page.wait_for("!document.getElementById('error').hidden")
    assert violations(page) == [], "with an error and a search that has ended"
    page.evaluate("document.getElementById('token-dialog').showModal()")
    assert violations(page) == [], "asking for the token"
    page.evaluate(
        "document.getElementById('token-dialog').append(document.createElement('button'))"
    )
    assert violations(page)[0].startswith("button-name: "), "axe-core sees what is wrong"


def test_axe_finds_no_violation_in_the_api_documentation(page: Page, robot: Robot) -> None:
    """With a request that was tried: all that is there at the start, and its form and answer."""
    page.call("Page.navigate", url=f"{robot.address}docs")
    page.wait_for("document.querySelector('.opblock') && document.querySelector('#problems tr')")
    assert page.errors == []
    page.click(".opblock-post .opblock-summary-control")
    page.wait_for("document.querySelector('.try-out__btn')")
    page.click(".try-out__btn")
    page.wait_for("document.querySelector('.execute')")
    page.click(".execute")
    page.wait_for("document.querySelector('.live-responses-table .language-json')")
    assert violations(page) == []
