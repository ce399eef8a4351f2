"""The live page asks with pictures: chosen, dropped, or cut out of the camera's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from onemap_shared.messages import MAX_IMAGE_BYTES
from onemap_shared.messages.checks import image_size_px
from tests.gateway.fakes import decoded
from tests.gateway.static.chromium import Page
from tests.gateway.static.conftest import PHONE, Robot, assert_accessible, photograph
from tests.gateway.static.test_page import PIXELS

pytestmark = pytest.mark.slow

OPENED = "document.getElementById('crop-dialog').open"
ANSWERED = "document.querySelectorAll('#regions-card li').length === 2"
FRAME = "document.getElementById('crop-size').textContent"
WHOLE = "Frame: 320 × 240 pixels of 320 × 240, 0 from the left, 0 from the top."


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    """A JPEG of 320 x 240 pixels: blue on grey."""
    (path := tmp_path / "sofa.jpg").write_bytes(photograph())
    return path


def choose(page: Page, path: Path) -> None:
    """Choose a file, as after a press of the button that opens the browser's own window."""
    root = page.call("DOM.getDocument")["root"]["nodeId"]
    node = page.call("DOM.querySelector", nodeId=root, selector="#image-file")["nodeId"]
    page.call("DOM.setFileInputFiles", nodeId=node, files=[str(path)])


def drop(page: Page, path: Path, place: tuple[float, float]) -> None:
    """Drop a file on the page."""
    data: dict[str, Any] = {"items": [], "files": [str(path)], "dragOperationsMask": 1}
    for kind in ("dragEnter", "dragOver", "drop"):
        page.call("Input.dispatchDragEvent", type=kind, x=place[0], y=place[1], data=data)


def ask(page: Page) -> None:
    page.click("#crop-ask")
    page.wait_for(ANSWERED)


def test_a_chosen_picture_is_asked_for_as_a_text_is(page: Page, robot: Robot, photo: Path) -> None:
    page.resize(*PHONE, mobile=True)
    page.open(robot.address)
    choose(page, photo)
    page.wait_for(OPENED)
    assert page.evaluate(FRAME) == WHOLE
    assert_accessible(page)
    ask(page)
    assert_accessible(page)
    answer = page.text("#regions-card")
    assert "What the image shows is at (0.35, 1.15) m" in answer
    assert "Not calibrated: these scores rank places" in answer
    image = decoded(robot.mapper.images[0])
    assert image.shape == (240, 320, 3)
    assert np.abs(image.astype(int) - decoded(photograph())).mean() < 3
    assert page.text("#heat") == "the picture"
    page.wait_for(f"{PIXELS % 'region'} > 20")
    page.click("#heat")
    page.wait_for("document.getElementById('heat').hidden")
    assert page.evaluate("document.getElementById('regions-card').hidden")
    assert page.errors == []


def test_the_map_shows_the_similarity_to_the_picture_until_a_text_is_asked(
    page: Page, robot: Robot, photo: Path
) -> None:
    shown = """(async () => {
      const { fetch } = window;
      window.drawn = [];
      window.fetch = (path, options) => {
        if (path.includes("map.png")) drawn.push(options.method);
        return fetch(path, options);
      };
    })()"""
    page.open(robot.address)
    page.evaluate(shown)
    choose(page, photo)
    page.wait_for(OPENED)
    ask(page)
    page.wait_for("drawn.includes('POST')")
    assert len(set(robot.mapper.images)) == 1
    pictures = "document.querySelectorAll('#regions-card img').length"
    assert page.evaluate(pictures) == 1
    page.type("#text", "kettle")
    page.click("#where")
    page.wait_for("document.getElementById('heat').innerText === 'kettle'")
    assert page.evaluate(pictures) == 0
    assert "Not calibrated" not in page.text("#regions-card")
    assert page.errors == []


def test_a_thing_is_cut_out_of_the_camera_image_with_the_mouse(page: Page, robot: Robot) -> None:
    page.open(robot.address)
    page.click(".pictures summary")
    page.click("#image-camera")
    page.wait_for(OPENED)
    # of 32 x 24 pixels: the middle, but no side shorter than the gateway takes
    assert page.evaluate(FRAME).startswith("Frame: 16 × 16 pixels of 32 × 24, 8 from the left")
    box = page.evaluate(
        "(({ x, y, width }) => [x, y, width / 32])"
        "(document.getElementById('crop').getBoundingClientRect())"
    )
    corners = [(box[0] + x * box[2], box[1] + y * box[2]) for x, y in ((16, 4), (32, 22))]
    page.drag(corners[0], corners[1])
    assert page.evaluate(FRAME).startswith("Frame: 16 × 18 pixels of 32 × 24, 16 from the left, 4")
    page.drag(corners[0], corners[0])  # a press draws no frame
    assert "16 × 18 pixels" in page.evaluate(FRAME)
    ask(page)
    assert image_size_px(robot.mapper.images[0]) == (16, 18)
    assert page.errors == []


def test_the_frame_is_moved_by_keys(page: Page, robot: Robot, photo: Path) -> None:
    page.open(robot.address)
    choose(page, photo)
    page.wait_for(OPENED)
    assert page.evaluate("document.activeElement.id") == "crop"
    for key, shift, frame in (
        ("ArrowLeft", True, "310 × 240"),
        ("ArrowUp", True, "310 × 233"),
        ("ArrowRight", False, "310 × 233 pixels of 320 × 240, 10 from the left, 0 from"),
        ("ArrowRight", False, "310 × 233 pixels of 320 × 240, 10 from the left, 0 from"),
        ("ArrowDown", False, "310 × 233 pixels of 320 × 240, 10 from the left, 7 from"),
    ):
        page.press(key, shift=shift)
        assert f"Frame: {frame}" in page.evaluate(FRAME)
    page.press("Escape")
    page.wait_for(f"!{OPENED}")
    assert robot.mapper.images == []
    assert page.errors == []


def test_a_picture_may_be_dropped_anywhere(page: Page, robot: Robot, photo: Path) -> None:
    page.open(robot.address)
    drop(page, photo, (300.0, 400.0))
    page.wait_for(OPENED)
    assert page.evaluate(FRAME) == WHOLE
    assert not page.evaluate("document.body.classList.contains('dropping')")
    ask(page)
    assert len(set(robot.mapper.images)) == 1
    assert page.errors == []


def test_a_file_that_is_no_picture_is_answered_by_a_sentence(
    page: Page, robot: Robot, tmp_path: Path
) -> None:
    (path := tmp_path / "notes.png").write_bytes(b"no picture")
    page.open(robot.address)
    choose(page, path)
    page.wait_for("!document.getElementById('error').hidden")
    assert page.text("#error").startswith("This file is no image that the browser can read")
    assert not page.evaluate(OPENED)


def test_a_large_picture_is_made_small_enough(page: Page, robot: Robot, tmp_path: Path) -> None:
    noise = np.random.default_rng(0).integers(0, 256, (1500, 2000, 3), np.uint8)
    cv2.imwrite(str(path := tmp_path / "noise.png"), noise)
    page.open(robot.address)
    choose(page, path)
    page.wait_for(OPENED)
    ask(page)
    assert image_size_px(robot.mapper.images[0]) == (640, 480)
    assert len(robot.mapper.images[0]) < MAX_IMAGE_BYTES
