"""Metres to pixels: x to the right, y up, on the pixel."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from onemap_gateway.present.canvas import Canvas, Viewport, ascii_text, draw_text

INK = (255, 255, 255)
coordinates = st.floats(-50, 50)


def canvas(size: int = 60, pixels_per_m: float = 10) -> Canvas:
    return Canvas(
        np.zeros((size, size, 3), np.uint8), Viewport(0.0, size / pixels_per_m, pixels_per_m)
    )


def centroid(image: np.ndarray) -> tuple[float, float]:
    """Mean column and row of the ink, in pixels whose centres are at halves."""
    weight = image[..., 0].astype(float)
    rows, columns = np.indices(weight.shape) + 0.5
    return float((columns * weight).sum() / weight.sum()), float(
        (rows * weight).sum() / weight.sum()
    )


@given(coordinates, coordinates, st.floats(1, 100))
def test_right_is_x_and_up_is_y(x: float, y: float, scale: float) -> None:
    viewport = Viewport(-50.0, 50.0, scale)
    here, right, above = viewport.pixels([(x, y), (x + 1, y), (x, y + 1)])
    np.testing.assert_allclose(right - here, [scale, 0], atol=1e-6)
    np.testing.assert_allclose(above - here, [0, -scale], atol=1e-6)


def test_the_corner_of_the_map_is_the_corner_of_the_image() -> None:
    np.testing.assert_allclose(Viewport(-1.0, 3.0, 20).pixels([(-1.0, 3.0)]), [[0, 0]])


@given(st.floats(1, 5), st.floats(1, 5))
def test_a_dot_lies_where_its_metres_say(x: float, y: float) -> None:
    drawn = canvas()
    drawn.dots([(x, y)], [4.0], INK)
    np.testing.assert_allclose(centroid(drawn.image), (10 * x, 60 - 10 * y), atol=0.3)


def test_a_ring_is_empty_inside() -> None:
    drawn = canvas()
    drawn.rings([(3.0, 3.0)], 8, INK, 2)
    assert drawn.image[30, 30, 0] == 0
    np.testing.assert_allclose(centroid(drawn.image), (30, 30), atol=0.3)


def test_an_arrow_points_along_its_yaw() -> None:
    for yaw, direction in ((0.0, (1, 0)), (np.pi / 2, (0, -1)), (np.pi, (-1, 0))):
        drawn = canvas()
        drawn.arrow(3.0, 3.0, yaw, 20, INK)
        rows, columns = np.nonzero(drawn.image[..., 0])
        reach = (columns + 0.5 - 30) * direction[0] + (rows + 0.5 - 30) * direction[1]
        assert reach.max() > 11
        assert -reach.min() < 11


def test_a_line_needs_two_points() -> None:
    drawn = canvas()
    drawn.line([(1.0, 1.0)], INK, 2)
    assert not drawn.image.any()
    drawn.line([(1.0, 1.0), (5.0, 1.0)], INK, 2)
    rows, columns = np.nonzero(drawn.image[..., 0])
    assert rows.min() >= 47
    assert rows.max() <= 52
    assert columns.max() - columns.min() >= 39


def test_places_far_away_draw_nothing_and_do_not_overflow() -> None:
    drawn = canvas()
    drawn.dots([(1e9, -1e9)], [4.0], INK)
    drawn.line([(1e9, 1e9), (1e9, 2e9)], INK, 2)
    assert not drawn.image.any()


@given(st.text())
def test_any_text_can_be_written(text: str) -> None:
    assert ascii_text(text).isascii()
    image = np.zeros((40, 40, 3), np.uint8)
    draw_text(image, "x" + text, (2, 20), INK)
    assert image.max() > 240


def test_accents_are_dropped_and_other_letters_marked() -> None:
    assert ascii_text("Café 椅") == "Cafe ?"


def test_a_label_stands_to_the_right_of_its_place() -> None:
    drawn = canvas(size=200, pixels_per_m=10)
    drawn.labels([(5.0, 10.0)], ["sofa"], INK)
    columns = np.nonzero(drawn.image.max(axis=2) > 100)[1]
    assert columns.min() >= 50


def test_a_label_that_would_not_fit_stands_to_the_left() -> None:
    wide = canvas(size=200)
    wide.labels([(19.0, 10.0)], ["refrigerator"], INK)
    assert wide.image[:, :190].any()
    assert not wide.image[:, 190:].any()


def test_labels_of_one_place_are_all_legible() -> None:
    """Drawn together they have as much ink as one by one: none covers another."""
    texts = ["sofa", "armchair", "floor lamp"]
    together = canvas(size=300)
    together.labels([(15.0, 15.0)] * 3, texts, INK)
    ink = 0
    for text in texts:
        alone = canvas(size=300)
        alone.labels([(15.0, 15.0)], [text], INK)
        ink += int((alone.image == 255).all(axis=2).sum())
    assert (together.image == 255).all(axis=2).sum() == ink


def test_every_pixel_of_a_text_is_outlined() -> None:
    for grey in (0, 90, 255):  # whatever is behind it
        image = np.full((40, 110, 3), grey, np.uint8)
        draw_text(image, "floor lamp", (6, 24), (200, 0, 0), (0, 0, 200))
        red, green, blue = np.moveaxis(image.astype(int), -1, 0)
        ink = (red > blue + 80) & (red > green + 80)
        outline = (blue > red + 80) & (blue > green + 80)
        assert ink.any()
        for row, column in np.argwhere(ink):
            assert outline[row - 3 : row + 4, column - 3 : column + 4].any()
        rows, columns = np.nonzero(ink)
        around = np.nonzero(outline)
        assert around[0].min() < rows.min()
        assert around[0].max() > rows.max()
        assert around[1].min() < columns.min()
        assert around[1].max() > columns.max()


def test_a_text_partly_or_wholly_outside_is_clipped() -> None:
    whole = np.zeros((60, 140, 3), np.uint8)
    draw_text(whole, "sofa", (30, 40), INK)
    part = np.zeros((30, 40, 3), np.uint8)
    draw_text(part, "sofa", (10, 40 - 20), INK)
    np.testing.assert_array_equal(part, whole[20:50, 20:60])
    for place in ((-500, 20), (500, 20), (10, -500), (10, 500)):
        outside = np.zeros((30, 40, 3), np.uint8)
        draw_text(outside, "sofa", place, INK)
        assert not outside.any()
