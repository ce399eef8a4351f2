"""The live page in a browser: ask, search, stop, finds, phone, light and dark."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest

from onemap_shared import keys
from onemap_shared import messages as m
from tests.gateway import fakes
from tests.gateway.static.chromium import WAIT_S, Page
from tests.gateway.static.conftest import PHONE, Robot, open_still, start_search
from tests.shared.samples import SAMPLES

pytestmark = pytest.mark.slow

# The colour of a canvas pixel is shown nowhere else: count those of one colour on the map.
PIXELS = """(() => {
  const canvas = document.getElementById("map");
  const style = getComputedStyle(document.documentElement);
  const hex = style.getPropertyValue("--map-%s").trim();
  const [r, g, b] = [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let count = 0;
  for (let i = 0; i < data.length; i += 4) {
    count += Math.abs(data[i] - r) + Math.abs(data[i + 1] - g) + Math.abs(data[i + 2] - b) < 12;
  }
  return count;
})()"""

# Left, top, right and bottom of the floor's pixels, in the window.
EXTENT = """(() => {
  const canvas = document.getElementById("map");
  const hex = getComputedStyle(document.documentElement).getPropertyValue("--map-free").trim();
  const wanted = [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
  const { data, width } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const { x: left, y: top } = canvas.getBoundingClientRect();
  const found = [Infinity, Infinity, -Infinity, -Infinity];
  for (let i = 0; i < data.length; i += 4) {
    if (wanted.some((value, channel) => Math.abs(data[i + channel] - value) > 3)) continue;
    const [x, y] = [left + ((i / 4) % width), top + Math.floor(i / 4 / width)];
    found[0] = Math.min(found[0], x);
    found[1] = Math.min(found[1], y);
    found[2] = Math.max(found[2], x);
    found[3] = Math.max(found[3], y);
  }
  return found;
})()"""
# Where the page's parts are: what a notice must not move.
PLACES = """["#map", "#zoom-in", "#where", "#regions-card"].map((name) => {
  const { x, y, width, height } = document.querySelector(name).getBoundingClientRect();
  return [x, y + scrollY, width, height];
})"""
# Whether a notice lies on the heat map's or a zoom button.
COVERED = """[...document.querySelectorAll("#notices li, #lost")].some((notice) => {
  const a = notice.getBoundingClientRect();
  return [...document.querySelectorAll("#heat, .zoom")].some((button) => {
    const b = button.getBoundingClientRect();
    return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  });
})"""

NEXT_PICTURE = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


def test_every_typed_name_is_asked(page: Page, robot: Robot) -> None:
    page.open(robot.address)
    page.type("#text", "sofa, kettle , ,kite")
    page.click("#where")
    page.wait_for("document.querySelectorAll('#regions-card h2').length === 3")
    answers = page.text("#regions-card")
    for name in ("sofa", "kettle", "kite"):
        assert f"{name.capitalize()}\n" in answers
        assert f"Understood as: {name}, anywhere." in answers
    assert "Nothing on the map looks like 'kite'" in answers
    assert page.text("#heat") == "sofa"
    page.click("#regions-card h2:nth-of-type(2) button")
    page.wait_for("document.getElementById('heat').innerText === 'kettle'")
    page.wait_for(f"{PIXELS % 'region'} > 20")
    assert page.errors == []


def test_an_answer_is_told_by_room_landmark_and_photograph(page: Page, robot: Robot) -> None:
    near = m.CheckedCondition("next to a desk", m.Holds.YES, "0.4 m from the desk")
    where = m.Whereabouts("study", landmark="desk", object_id="o0", conditions=(near,))
    robot.keep("sofa", 0.4, 1.1)
    robot.mapper.bus.serve(
        keys.MAP_SIMILARITY,
        lambda request: replace(
            robot.mapper.similarity(request), whereabouts=(where, m.Whereabouts())
        ),
    )
    page.open(robot.address)
    page.type("#text", "sofa next to the desk")
    page.click("#where")
    page.wait_for("document.querySelector('#regions-card canvas')")
    page.wait_for("document.querySelector('#finds button')")
    label = page.evaluate("document.querySelector('#regions-card canvas').ariaLabel")
    assert label.startswith("Photograph of the sofa")  # with the request until finds are there
    first, second = page.evaluate("""[...document.querySelectorAll("#regions-card li")].map(
      (row) => row.innerText.split("\\n"))""")
    assert first[1:3] == ["In the study, next to the desk", "✓ next to a desk: 0.4 m from the desk"]
    assert second[1].startswith("1.0, 1.0 m")
    page.click("#regions-card li button")
    page.wait_for("document.getElementById('find-card').open")
    assert page.errors == []


@pytest.mark.parametrize(("typed", "count", "searching"), [("sofa", 2, True), ("kite", 1, False)])
def test_an_answer_is_in_sight_on_a_phone(
    page: Page, robot: Robot, typed: str, count: int, searching: bool
) -> None:
    page.resize(390, 844, mobile=True)
    page.open(robot.address)
    start_search(page)
    if not searching:
        page.click("#stop")
        page.wait_for("document.getElementById('search-state').innerText === 'cancelled'")
    page.evaluate("window.scrollTo(0, 0)")
    page.type("#text", typed)
    page.click("#where")
    page.wait_for(f"document.querySelectorAll('#regions-card li').length === {count}")
    page.wait_for("window.scrollY > 0")
    assert page.centre("#regions-card h2") is not None
    assert page.centre("#regions-card li:last-child") is not None
    assert page.errors == []


def test_a_suggested_word_replaces_only_its_own_name(page: Page, robot: Robot) -> None:
    page.open(robot.address)
    page.type("#text", "flurb, sofa")
    page.click("#where")
    page.wait_for("document.querySelectorAll('#regions-card h2').length === 2")
    assert "does not know 'flurb'" in page.text("#regions-card")
    assert page.text("#heat") == "sofa"  # a refused name does not hide the answers to others
    page.click(".word")
    page.wait_for("document.getElementById('text').value === 'curb, sofa'")


def test_a_search_is_started_followed_and_stopped(page: Page, robot: Robot) -> None:
    page.open(robot.address)
    start_search(page)
    assert robot.planner.status is not None
    assert robot.planner.status.objects == ("sofa", "kettle")
    page.wait_for("document.getElementById('search-title').innerText === 'Looking for the sofa'")
    robot.move()
    page.wait_for(f"{PIXELS % 'path'} > 20")
    page.click("#stop")
    page.wait_for("document.getElementById('search-state').innerText === 'cancelled'")
    page.wait_for(f"{PIXELS % 'path'} === 0")
    assert page.evaluate("document.getElementById('stop').hidden")
    assert page.errors == []


def test_a_robot_that_another_program_drives_has_a_stop_button(page: Page, robot: Robot) -> None:
    stop_hidden = "document.getElementById('stop').hidden"
    page.open(robot.address)
    assert page.evaluate(stop_hidden)
    robot.drives(0.3)
    page.wait_for(f"!{stop_hidden}")
    assert page.text("#search-title") == "The robot moves"
    page.click("#stop")
    page.wait_for("document.getElementById('error').innerText.startsWith('No search moves')")
    robot.drives(0.0)
    page.wait_for(stop_hidden)
    assert page.errors == [
        "Failed to load resource: the server responded with a status of 404 (Not Found)"
    ]


def test_a_search_that_the_page_does_not_know_yet_is_stopped_or_the_error_told(
    page: Page, robot: Robot
) -> None:
    page.open(robot.address)
    robot.drives(0.3)
    page.wait_for("!document.getElementById('stop').hidden")
    error = "document.getElementById('error').innerText"
    robot.planner.status = fakes.search("s7")  # no live message tells of it
    page.click("#stop")
    page.wait_for("document.getElementById('search-state').innerText === 'cancelled'")
    assert page.evaluate(error) == ""
    page.wait_for(
        "!document.getElementById('stop').hidden && !document.getElementById('stop').disabled"
    )
    robot.router.servers[keys.SEARCH_CANCEL.key].clear()  # the planner is away
    page.click("#stop")
    page.wait_for(f"{error} !== ''")
    assert "planner" in page.evaluate(error)


def test_a_find_is_told_by_a_notification_that_was_allowed(page: Page, robot: Robot) -> None:
    page.open(robot.address)
    page.evaluate("""(() => {
      window.told = [];
      window.Notification = class {
        static permission = "default";
        static requestPermission = async () => (Notification.permission = "granted");
        constructor(title, { body } = {}) {
          if (Notification.permission === "granted") told.push([title, body]);
        }
      };
    })()""")
    start_search(page, "red sofa")
    page.click("#notify")
    page.wait_for("document.getElementById('notify').hidden")
    assert robot.planner.status is not None
    found = replace(fakes.find_result("sofa", 1.0, 1.0), reason="seen twice")
    robot.planner.status = replace(robot.planner.status, results=(found,))
    robot.planner.move(m.SearchState.FOUND)
    page.wait_for("told.length === 1")
    assert page.evaluate("told") == [["Found the red sofa", "seen twice"]]


def test_a_browser_whose_notifications_cannot_be_made_loses_nothing(
    page: Page, robot: Robot
) -> None:
    page.open(robot.address)
    page.evaluate("""window.Notification = class {
      static permission = "default";
      constructor() { throw new TypeError("Illegal constructor."); }
    }""")
    start_search(page, "sofa")
    assert page.evaluate("document.getElementById('notify').hidden")
    page.evaluate("void (Notification.permission = 'granted')")
    assert robot.planner.status is not None
    found = fakes.find_result("sofa", 1.0, 1.0)
    robot.planner.status = replace(robot.planner.status, results=(found,))
    robot.planner.move(m.SearchState.FOUND)
    page.wait_for(
        "document.querySelector('#objects .found') && !document.getElementById('back').hidden"
    )
    assert page.errors == []


def test_stop_is_in_sight_on_a_small_phone(page: Page, robot: Robot) -> None:
    page.resize(*PHONE, mobile=True)
    page.open(robot.address)
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE[0]
    start_search(page, "sofa")
    for place in ("0", "document.body.scrollHeight / 2", "document.body.scrollHeight"):
        page.evaluate(f"window.scrollTo(0, {place})")
        assert page.centre("#stop") is not None, place
    height = page.evaluate("document.getElementById('stop').getBoundingClientRect().height")
    assert height >= 44
    page.click("#stop")
    page.wait_for("document.getElementById('search-state').innerText === 'cancelled'")
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE[0]
    assert page.errors == []


@pytest.mark.parametrize("size", [(1280, 800), PHONE])
def test_notices_move_nothing_and_cover_no_button(
    page: Page, robot: Robot, size: tuple[int, int]
) -> None:
    page.resize(*size)
    page.open(robot.address)
    page.type("#text", "sofa")
    page.click("#where")
    page.wait_for("!document.getElementById('heat').hidden")
    page.evaluate("document.getElementById('notices').style.display = 'none'")
    before = page.evaluate(PLACES)
    page.evaluate("document.getElementById('notices').style.display = ''")
    page.wait_for("document.querySelectorAll('#notices li').length > 1")
    page.evaluate("document.getElementById('lost').hidden = false")
    assert page.evaluate(PLACES) == before
    page.evaluate("window.scrollTo(0, 0)")
    for button in ("#heat", "#zoom-in", "#zoom-out", "#zoom-fit"):
        assert page.centre(button) is not None, button
    assert page.centre("#notices li") is None, "a press on a notice is meant for the map"
    assert page.evaluate(COVERED) is False


def test_the_whole_map_lies_beside_what_covers_it(page: Page, robot: Robot) -> None:
    """The legend is closed at first; opened, it pushes the map aside and leaves buttons free."""
    covered = """(() => {
      const [left, top, right, bottom] = (%s);
      return ["#legend", ".zoom", "#freshness"].filter((name) => {
        const box = document.querySelector(name).getBoundingClientRect();
        return left < box.right && box.left < right && top < box.bottom && box.top < bottom;
      });
    })()"""
    for size in ((1280, 800), PHONE, (390, 844), (844, 390)):
        page.resize(*size, mobile=size[0] < 1000)
        open_still(page, robot)
        assert page.evaluate("document.getElementById('legend').open") is False
        assert page.evaluate(covered % EXTENT) == []
        page.click("#legend summary")
        page.wait_for("document.getElementById('legend').open")
        page.evaluate(NEXT_PICTURE)
        assert page.evaluate(covered % EXTENT) == []
        page.evaluate("window.scrollTo(0, 0)")
        for button in ("in", "out", "fit"):
            assert page.centre(f"#zoom-{button}") is not None, (size, button)


def test_a_sentence_is_one_object_and_how_it_was_understood_is_shown(
    page: Page, robot: Robot
) -> None:
    open_still(page, robot)
    start_search(page, "red sofa, next to the bed, not in the hall, then kettle")
    said = "red sofa, within 1 m of a bed, not in the hall; kettle, anywhere"
    page.wait_for(
        f"document.getElementById('search-understood').innerText === 'Understood as: {said}.'"
    )
    assert robot.planner.requests[-1].objects == ("sofa", "kettle")
    title = "Looking for the red sofa next to a bed not in the hall"
    assert page.text("#search-title") == title
    assert page.errors == []


def test_names_are_offered_for_a_description_while_it_is_typed(page: Page, robot: Robot) -> None:
    sample = next(each for each in SAMPLES if isinstance(each, m.TextEmbeddings))

    def embed(request: m.TextRequest) -> m.TextEmbeddings:
        one = sample.only(np.zeros(1, np.int64))
        return replace(one, texts=request.texts, stands_for=(("chair", "sofa"),))

    robot.router.bus("perception").serve(keys.EMBED_TEXT, embed)
    open_still(page, robot)
    page.type("#text", "kettle, something to sit on")
    page.wait_for("document.querySelector('#suggestions button').innerText === 'chair'")
    page.type("#text", "kettle")
    page.wait_for("document.querySelector('#suggestions button').innerText === 'bed'")
    assert page.errors == []


def test_stop_takes_the_connections_of_the_page_itself(page: Page, robot: Robot) -> None:
    """A browser opens six to one gateway: what waits in them would hold the stop back."""
    asked, release = threading.Event(), threading.Event()

    def wait(_request: m.SearchListRequest) -> m.SearchList:
        asked.set()
        release.wait(WAIT_S)
        return m.SearchList(())

    page.open(robot.address)
    start_search(page)
    robot.planner.bus.serve(keys.SEARCH_LIST, wait)
    page.evaluate("""import("/static/api.js").then(({ read }) => {
      window.ends = [];
      const failed = ({ message }) => ends.push(message);
      for (let i = 0; i < 6; i += 1) read("/v1/searches").catch(failed);
    })""")
    assert asked.wait(WAIT_S)
    page.click("#stop")
    page.wait_for("!document.body.classList.contains('searching')")
    page.wait_for("ends.length === 6")
    release.set()
    assert page.evaluate("[...new Set(ends)]") == [
        "This was given up to stop the robot first: try again."
    ]
