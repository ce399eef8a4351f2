"""Images: canvas, labels, colours, the map with its heatmap and overlay, the camera."""

from __future__ import annotations

import re
from dataclasses import asdict
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_gateway.http.routes.pages import STATIC
from onemap_gateway.present import render
from onemap_gateway.present.canvas import ascii_text, draw_text, overlap, place_labels
from onemap_gateway.present.palette import DARK, LIGHT, PALETTES, Palette, Rgb, Theme
from onemap_gateway.present.render import Overlay, occupancy_image, render_map
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Occupancy, SearchView
from tests.gateway.fakes import search_view
from tests.reference import heatmap

INK = (255, 255, 255)


@pytest.mark.parametrize("text", ["", "Küche", "厨房", "a\0\n\x7f", "\u202e", "\ud800", "😀" * 99])
def test_any_text_can_be_written(text: str) -> None:
    assert ascii_text(text).isascii()
    image = np.zeros((40, 40, 3), np.uint8)
    draw_text(image, "x" + text, (2, 20), INK)
    assert image.max() > 240


IMAGE_PX = (400.0, 300.0)
SIZE_PX = (60.0, 12.0)
points = st.tuples(st.floats(0, IMAGE_PX[0]), st.floats(0, IMAGE_PX[1]))


@given(st.lists(points, max_size=8))
def test_a_few_labels_never_overlap_and_stay_inside(points_px: list[tuple[float, float]]) -> None:
    boxes = place_labels(points_px, [SIZE_PX] * len(points_px), IMAGE_PX)
    assert all(box[0] >= 0 and box[2] <= IMAGE_PX[0] for box in boxes)
    assert all(box[1] >= 0 and box[3] <= IMAGE_PX[1] for box in boxes)
    assert not any(overlap(a, b) for a, b in combinations(boxes, 2))


TEXT_CONTRAST = 4.5  # WCAG 2.2 AA, 1.4.3
MARK_CONTRAST = 3.0  # 1.4.11
ON_THE_PAGE = {"found": "find"}  # fields that the page calls otherwise
BOTH = pytest.mark.parametrize("palette", [DARK, LIGHT], ids=["dark", "light"])


def luminance(colour: Rgb) -> float:
    linear = [
        c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4
        for c in (value / 255 for value in colour)
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(a: Rgb, b: Rgb) -> float:
    darker, brighter = sorted((luminance(a), luminance(b)))
    return (brighter + 0.05) / (darker + 0.05)


def hexadecimal(colour: Rgb) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)


@BOTH
def test_texts_marks_and_walls_contrast_with_their_ground(palette: Palette) -> None:
    for colour in (palette.found, palette.region, palette.ink):
        assert contrast(colour, palette.unknown) >= TEXT_CONTRAST
    for mark in ("trail", "path", "frontier", "region", "robot", "found"):
        for ground in (palette.free, palette.unknown):
            assert contrast(getattr(palette, mark), ground) >= MARK_CONTRAST, mark
    assert contrast(palette.occupied, palette.free) >= MARK_CONTRAST
    assert contrast(palette.wall, palette.occupied) >= MARK_CONTRAST


@pytest.mark.parametrize("theme", list(Theme))
def test_the_page_has_the_same_colours(theme: Theme) -> None:
    dark, _, light = (STATIC / "style.css").read_text("utf-8").partition("@media (prefers-color")
    text = dark if theme is Theme.DARK else light
    for name, colour in asdict(PALETTES[theme]).items():
        found = re.search(rf"--map-{ON_THE_PAGE.get(name, name)}: ([^;]+);", text)
        assert found, name
        expected = colour if name == "heat" else (colour,)
        assert found[1] == ", ".join(map(hexadecimal, expected)), name


COLOURS = {
    Occupancy.UNKNOWN: DARK.unknown,
    Occupancy.FREE: DARK.free,
    Occupancy.OCCUPIED: DARK.occupied,
}
grids = arrays(
    np.uint8, st.tuples(st.integers(1, 12), st.integers(1, 12)), elements=st.integers(0, 2)
)


def colour_at(map_image: render.MapImage, x_m: float, y_m: float) -> tuple[int, ...]:
    """The colour of the image at a point of the map."""
    x_min, y_min, x_max, y_max = map_image.bounds_m
    height, width = map_image.image.shape[:2]
    column = int((x_m - x_min) / (x_max - x_min) * width)
    row = int((y_max - y_m) / (y_max - y_min) * height)
    return tuple(int(value) for value in map_image.image[row, column])


@given(grids, st.integers(1, 5))
def test_every_cell_has_its_colour_at_its_place(occupancy: np.ndarray, scale: int) -> None:
    image = occupancy_image(occupancy, scale)
    nx, ny = occupancy.shape
    assert image.shape == (ny * scale, nx * scale, 3)
    for ix in range(nx):
        for iy in range(ny):
            row, column = (ny - 1 - iy) * scale, ix * scale
            block = image[row : row + scale, column : column + scale].reshape(-1, 3)
            assert {tuple(pixel) for pixel in block} == {COLOURS[Occupancy(occupancy[ix, iy])]}


@settings(max_examples=30)
@given(
    arrays(np.uint8, (5, 7, 3)),
    arrays(np.float32, (5, 7), elements=st.floats(0, 1, width=32)),
    arrays(np.uint8, (5, 7), elements=st.integers(0, 1)),
    st.sampled_from([DARK, LIGHT]),
)
def test_tables_of_heat_are_within_two_levels_of_the_formula(
    image: np.ndarray, heat: np.ndarray, inside: np.ndarray, palette: Palette
) -> None:
    fast = render._heated(image, heat, inside, palette)
    slow = heatmap.heated(image, heat, inside, palette)
    assert np.abs(fast.astype(int) - slow).max() <= 2
    np.testing.assert_array_equal(fast[inside == 0], image[inside == 0])


@BOTH
def test_an_overlay_is_drawn_over_the_bare_map(palette: Palette) -> None:
    view = search_view()
    bare = render_map(view, scale=8, palette=palette)
    overlay = Overlay(
        trail_m=np.array([(0.2, 0.2), (0.4, 0.2)]),
        path_m=np.array([(0.5, 0.5), (1.5, 0.5)]),
        goal_m=np.array([(1.5, 0.5)]),
        frontiers_m=np.array([(0.3, 1.2)]),
        frontier_scores=np.array([np.nan]),
        regions_m=np.array([(1.2, 1.2)]),
        robot=(0.5, 0.8, 0.0),
        found=(("teddy bear", 1.7, 0.2),),
    )
    drawn = render_map(view, overlay, 8, palette)
    assert drawn.bounds_m == bare.bounds_m
    assert colour_at(drawn, 1.0, 0.5) == palette.path
    assert colour_at(drawn, 0.3, 1.2) == palette.frontier
    assert colour_at(drawn, 0.5, 0.8) == palette.robot
    assert colour_at(drawn, 1.7, 0.2) == palette.found
    assert colour_at(bare, 1.0, 0.5) == palette.free
    assert colour_at(bare, 1.0, 1.9) == palette.unknown
    assert colour_at(drawn, 1.0, 1.0) == colour_at(bare, 1.0, 1.0)


@pytest.mark.parametrize("scale", [1, 32])
def test_a_large_map_has_an_image_of_bounded_size(scale: int) -> None:
    shape = (3000, 200)
    occupancy = np.full(shape, Occupancy.FREE, np.uint8)
    none = np.zeros((0, 0), np.float32)
    view = SearchView("", 1, 1, 1, GridSpec(0.05, (0, 0), shape), occupancy, occupancy, none)
    assert max(render_map(view, scale=scale).image.shape) <= render.MAX_PX


def test_the_image_shows_what_is_known_with_a_margin_and_the_robot_unless_it_is_far_off() -> None:
    bare = render_map(search_view(), Overlay())
    np.testing.assert_allclose(bare.bounds_m, (-0.5, -0.5, 2.6, 2.0), atol=0.11)
    near = render_map(search_view(), Overlay(robot=(-9.0, 8.0, 0.0)))
    assert near.bounds_m[0] < -9.0
    assert near.bounds_m[3] > 8.0
    far = render_map(search_view(), Overlay(robot=(-90_000.0, 0.0, 0.0)))
    assert far.bounds_m == bare.bounds_m
