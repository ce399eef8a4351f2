"""A scene mapped without bus and robot, and what the map was shown of it."""

from __future__ import annotations

import numpy as np

from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_tools.bench.mapping import (
    INTRINSICS,
    MAX_OBSERVED_RANGE_M,
    MIN_OBSERVED_PIXELS,
    map_scene,
    observed_categories,
    rendered_field,
)
from tests.perception.toy import ColourEncoder
from tests.simulator.scenes import box_room

ROOM = box_room()


def view(pixels: int, depth_m: float) -> RenderedImage:
    """An image in which the first object fills so many pixels at one depth."""
    labels = np.full(320 * 240, -1, np.int32)
    labels[:pixels] = 0
    shape = (240, 320)
    return RenderedImage(
        np.zeros((*shape, 3), np.uint8),
        np.full(shape, depth_m, np.float32),
        labels.reshape(shape),
        np.full(shape, -1, np.int32),
    )


def test_an_object_counts_as_observed_if_it_is_large_and_near() -> None:
    category = ROOM.objects[0].category
    enough, near = MIN_OBSERVED_PIXELS, MAX_OBSERVED_RANGE_M
    assert observed_categories(ROOM, view(enough, near)) == {category}
    assert observed_categories(ROOM, view(enough - 1, near)) == set()
    assert observed_categories(ROOM, view(enough, near + 0.1)) == set()


def test_a_field_carries_the_measured_depth_and_the_pose() -> None:
    encoder = ColourEncoder()
    T_map_camera = np.eye(4)
    field = rendered_field(view(0, 1.2345), T_map_camera, 4, encoder)
    assert np.unique(field.depth_mm).tolist() == [1234]
    assert (field.sequence, field.encoder_id) == (4, encoder.encoder_id)
    assert field.intrinsics == INTRINSICS
    np.testing.assert_array_equal(field.T_map_camera, T_map_camera)


def test_the_map_of_a_seed_repeats_itself() -> None:
    first, second = (map_scene(ROOM, ColourEncoder(), seed=3, images=4) for _ in range(2))
    assert first.observed == second.observed
    assert first.belief.frames_fused == 4
    assert first.belief.store.count == second.belief.store.count > 100
    other = map_scene(ROOM, ColourEncoder(), seed=4, images=4)
    assert other.belief.store.count != first.belief.store.count
