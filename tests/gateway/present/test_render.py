"""The map image: orientation, colours, extent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_gateway.present import render
from onemap_gateway.present.palette import DARK, LIGHT, Palette
from onemap_gateway.present.render import (
    Overlay,
    blend_heatmap,
    encode_png,
    occupancy_image,
    render_map,
)
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Occupancy, SearchView
from tests.gateway.fakes import GRID, search_view
from tests.reference import heatmap

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


@pytest.mark.parametrize("scale", [None, 1, 3, 8])
def test_places_of_the_map_show_what_they_are(scale: int | None) -> None:
    map_image = render_map(search_view(), scale=scale)
    assert colour_at(map_image, 1.0, 0.5) == DARK.free
    assert colour_at(map_image, 2.05, 0.5) == DARK.occupied  # the wall, at the right
    assert colour_at(map_image, 1.0, 1.7) == DARK.unknown  # above the floor
    assert colour_at(map_image, -0.3, 0.5) == DARK.unknown


def test_the_image_shows_the_known_part_with_a_margin() -> None:
    x_min, y_min, x_max, y_max = render_map(search_view()).bounds_m
    np.testing.assert_allclose((x_min, y_min, x_max, y_max), (-0.5, -0.5, 2.6, 2.0), atol=0.11)


def test_the_robot_is_always_in_the_image() -> None:
    map_image = render_map(search_view(), Overlay(robot=(-9.0, 8.0, 0.0)))
    assert map_image.bounds_m[0] < -9.0
    assert map_image.bounds_m[3] > 8.0


def test_an_empty_map_has_an_image_too() -> None:
    nothing = np.zeros((0, 0), np.uint8)
    grid = GridSpec(0.05, (0, 0), (0, 0))
    empty = SearchView("", 0, 0, 0, grid, nothing, nothing, np.zeros((0, 0), np.float32))
    for overlay in (None, Overlay(), Overlay(robot=(1.0, 1.0, 0.0))):
        assert min(render_map(empty, overlay).image.shape[:2]) > 100


def test_heat_lies_where_the_similarity_is() -> None:
    cold, hot = render_map(search_view()), render_map(search_view("sofa"))
    assert colour_at(cold, 0.35, 1.15) == DARK.free
    red, _, blue = colour_at(hot, 0.35, 1.15)
    assert red > 150
    assert red > blue
    assert colour_at(hot, 1.5, 0.3) == DARK.free


@given(arrays(np.float32, (6, 9), elements=st.floats(0, 1, width=32) | st.just(np.nan)))
def test_heat_leaves_alone_what_was_not_observed(similarity: np.ndarray) -> None:
    before = occupancy_image(np.full((6, 9), Occupancy.FREE, np.uint8), 3)
    copy = before.copy()
    after = blend_heatmap(before, similarity)
    np.testing.assert_array_equal(before, copy)
    unseen = np.kron(np.isnan(similarity).T[::-1], np.ones((3, 3))).astype(bool)
    np.testing.assert_array_equal(after[unseen], before[unseen])


def test_heat_does_not_bleed_into_unknown_cells() -> None:
    """Fused features reach past the wall and into furniture; their heat is not drawn there."""
    view = search_view("sofa")
    occupancy = view.occupancy.copy()
    occupancy[18:22, 10:14] = Occupancy.OCCUPIED  # furniture,
    occupancy[19:21, 11:13] = Occupancy.UNKNOWN  # and its inside that no ray has reached
    similarity = np.full(GRID.shape, 0.9, np.float32)
    cold = render_map(replace(view, occupancy=occupancy, similarity=np.zeros((0, 0), np.float32)))
    hot = render_map(replace(view, occupancy=occupancy, similarity=similarity))
    unknown = (cold.image == DARK.unknown).all(axis=2)
    np.testing.assert_array_equal(hot.image[unknown], cold.image[unknown])
    assert (hot.image[~unknown] != cold.image[~unknown]).any(axis=-1).all()


@given(arrays(np.float32, (5, 4), elements=st.just(0.5) | st.just(np.nan)))
def test_heat_does_not_fade_at_the_border(similarity: np.ndarray) -> None:
    scored = np.kron(np.isfinite(similarity).T[::-1], np.ones((4, 4))).astype(bool)
    image = blend_heatmap(np.zeros((16, 20, 3), np.uint8), similarity)
    assert len(np.unique(image[scored], axis=0)) <= 1


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


def test_a_weak_best_match_stays_cold() -> None:
    floor = occupancy_image(np.full((5, 5), Occupancy.FREE, np.uint8), 2)
    faint = blend_heatmap(floor, np.full((5, 5), 0.02, np.float32))
    np.testing.assert_array_equal(faint, floor)
    sure = blend_heatmap(floor, np.full((5, 5), 0.9, np.float32))
    assert sure.max() > 200


def test_an_overlay_is_drawn_over_the_bare_map() -> None:
    view = search_view()
    bare = render_map(view, scale=8)
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
    drawn = render_map(view, overlay, 8)
    assert drawn.bounds_m == bare.bounds_m
    assert colour_at(drawn, 1.0, 0.5) == DARK.path
    assert colour_at(drawn, 0.3, 1.2) == DARK.frontier
    assert colour_at(drawn, 0.5, 0.8) == DARK.robot
    assert colour_at(drawn, 1.7, 0.2) == DARK.found
    assert colour_at(drawn, 1.0, 1.0) == colour_at(bare, 1.0, 1.0)


def test_the_view_is_not_written_to() -> None:
    view = search_view("sofa")
    copy = replace(view, occupancy=view.occupancy.copy(), similarity=view.similarity.copy())
    render_map(view, Overlay(robot=(0, 0, 0)))
    np.testing.assert_array_equal(view.occupancy, copy.occupancy)
    np.testing.assert_array_equal(view.similarity, copy.similarity)


@pytest.mark.parametrize("scale", [1, 32])
def test_a_large_map_has_an_image_of_bounded_size(scale: int) -> None:
    shape = (3000, 200)
    occupancy = np.full(shape, Occupancy.FREE, np.uint8)
    none = np.zeros((0, 0), np.float32)
    view = SearchView("", 1, 1, 1, GridSpec(0.05, (0, 0), shape), occupancy, occupancy, none)
    assert max(render_map(view, scale=scale).image.shape) <= render.MAX_PX


def test_png_is_png() -> None:
    assert encode_png(render_map(search_view()).image).startswith(b"\x89PNG")
    assert GRID.cell_size_m == 0.1


def test_a_light_page_gets_a_light_map() -> None:
    overlay = Overlay(found=(("lamp", 1.7, 0.2),))
    light = render_map(search_view("sofa"), overlay, palette=LIGHT)
    assert colour_at(light, 1.0, 0.5) == LIGHT.free
    assert colour_at(light, 1.0, 1.7) == LIGHT.unknown
    assert colour_at(light, 1.7, 0.2) == LIGHT.found
    dark = render_map(search_view("sofa"), overlay)
    assert light.image.mean() > dark.image.mean() + 100


@pytest.mark.parametrize("x_m", [2_000.0, -90_000.0])
def test_a_robot_far_off_does_not_stretch_the_image(x_m: float) -> None:
    near = render_map(search_view(), Overlay())
    far = render_map(search_view(), Overlay(robot=(x_m, 0.0, 0.0)))
    assert far.bounds_m == near.bounds_m
    assert far.image.shape == near.image.shape
