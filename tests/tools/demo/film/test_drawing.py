"""The pictures of a film."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_gateway.present.palette import DARK
from onemap_gateway.present.render import Overlay
from onemap_shared.geometry import U8
from onemap_shared.messages import Detections, SearchState
from onemap_tools.demo.film import drawing
from onemap_tools.demo.film.drawing import (
    CAMERA,
    CAPTION,
    LISTED_OBJECTS,
    MAP,
    OBJECTS,
    PICTURE,
    Panel,
    caption_text,
    common_bounds,
    draw_camera,
    draw_map,
    draw_moment,
    fitted,
    object_lines,
    text_width_px,
)
from tests.tools.demo.film.moments import FOUND_BED, map_view, moment, search_status

BOUNDS = (-1.0, -1.0, 7.0, 5.0)
RESULTS = [replace(FOUND_BED, name=f"thing {i}") for i in range(9)]


def part(picture: U8, panel: Panel) -> U8:
    return picture[panel.top : panel.top + panel.height, panel.left : panel.left + panel.width]


def changed(panel: Panel, **values: object) -> bool:
    """Whether the panel differs from that of a plain moment."""
    plain = draw_moment(moment(), BOUNDS, 4.0)
    other = draw_moment(moment(**values), BOUNDS, 4.0)  # type: ignore[arg-type]
    return not np.array_equal(part(plain, panel), part(other, panel))


def test_a_picture_has_the_size_of_all_pictures() -> None:
    picture = draw_moment(moment(), BOUNDS, 4.0)
    assert picture.shape == (PICTURE.height, PICTURE.width, 3)
    assert picture.dtype == np.uint8


def test_every_part_shows_its_own() -> None:
    driven = Overlay(trail_m=np.array([[0.5, 1.0], [4.0, 1.0]]), robot=(4.0, 1.0, 0.0))
    assert changed(MAP, overlay=driven)
    assert changed(MAP, overlay=Overlay(found=(("bed", 2.0, 2.0),)))
    assert changed(CAMERA, shade=140)
    assert changed(OBJECTS, status=search_status(SearchState.EXPLORING, FOUND_BED))
    assert changed(CAPTION, elapsed_s=12.0)
    assert not changed(MAP, shade=140)


def test_the_map_stands_still_while_it_grows() -> None:
    early, late = moment(view=map_view((20, 20), (10, 10))), moment(view=map_view())
    bounds = common_bounds([early, late])
    assert bounds == common_bounds([late])
    size = (532, 478)
    before, after = draw_map(early, bounds, size), draw_map(late, bounds, size)
    assert before.shape == after.shape == (478, 532, 3)
    free = np.all(before == DARK.free, axis=-1)
    assert np.all(after[free] == DARK.free)
    rows, columns = np.nonzero(free)
    scale = min(size[0] / (bounds[2] - bounds[0]), size[1] / (bounds[3] - bounds[1]))
    assert np.ptp(columns) == pytest.approx(2.0 * scale, abs=3)
    assert columns.mean() == pytest.approx(size[0] / 2 + (2.0 - 3.0) * scale, abs=2)
    assert rows.mean() == pytest.approx(size[1] / 2 - (2.0 - 2.0) * scale, abs=2)


def test_boxes_grow_with_the_camera_image() -> None:
    box = np.array([[80.0, 60.0, 240.0, 180.0]], np.float32)
    points, owners = np.zeros((0, 3), np.float32), np.zeros(0, np.int32)
    seen = Detections(1, 1, "d", ("bed",), box, np.array([0.9], np.float32), points, owners)
    plain = draw_camera(moment(), (640, 480))
    marked = draw_camera(moment(detections=seen), (640, 480))
    rows, columns = np.nonzero(np.any(plain != marked, axis=-1))
    assert (columns.min(), columns.max()) == pytest.approx((160, 480), abs=3)
    assert rows.max() == pytest.approx(360, abs=3)


def test_the_caption_says_what_is_searched_and_how_it_ended() -> None:
    status = search_status(SearchState.APPROACHING, FOUND_BED)
    caption = caption_text(moment(12.3, status=status))
    assert caption.split("   ") == ["Looking for: sofa", "approaching", "12 s", "1 of 3 found"]
    done = search_status(SearchState.FOUND, FOUND_BED, objects=("bed",))
    assert caption_text(moment(30.0, status=done)) == "1 of 1 found in 30 s"
    failed = search_status(SearchState.FAILED, FOUND_BED, reason="the map was lost")
    ended = "1 of 3 found in 30 s   failed: the map was lost"
    assert caption_text(moment(30.0, status=failed)) == ended


def test_objects_are_listed_around_the_present_one() -> None:
    lines = [text for text, _ in object_lines(search_status(SearchState.EXPLORING, FOUND_BED))]
    assert lines == ["bed: found after 8 s", "sofa: exploring", "toilet: next"]
    names = tuple(f"thing {i}" for i in range(9))
    for done in range(9):
        status = search_status(SearchState.EXPLORING, *RESULTS[:done], objects=names)
        texts = [text for text, _ in object_lines(status)]
        assert len(texts) == LISTED_OBJECTS
        assert f"thing {done}: exploring" in texts


@pytest.mark.parametrize("width_px", [60, 200, 300])
def test_a_text_is_cut_to_its_width(width_px: int) -> None:
    text = "sought in vain in every room of the apartment, twice"
    cut = fitted(text, width_px)
    assert cut.endswith("...")
    assert text_width_px(cut) <= width_px
    assert fitted(text, text_width_px(text)) == text


def test_the_longest_texts_stay_in_their_parts() -> None:
    word = "a very long name of a thing that nobody would ever look for in an apartment"
    status = search_status(SearchState.FAILED, objects=(word,), reason=word)
    picture = draw_moment(moment(99.0, status=status), BOUNDS, 4.0)
    assert np.all(picture[:, PICTURE.width - 10 :] == drawing.PAGE)
