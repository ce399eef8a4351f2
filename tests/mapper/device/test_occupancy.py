"""Occupancy by torch, against NumPy and the compiled code: bit for bit."""

from __future__ import annotations

import numpy as np
import torch
from hypothesis import settings

from onemap_mapper.device.floor import device_floor
from onemap_mapper.device.occupancy import device_flying_pixels, device_occupancy
from onemap_mapper.floor import floor_points
from onemap_mapper.flying_pixels import flying_pixels
from onemap_mapper.occupancy import occupancy_update
from tests.mapper import scenes
from tests.mapper.device.frames import IMAGES, WORLDS, clouds, seen
from tests.mapper.scenes import Box


@IMAGES
@settings(max_examples=30, deadline=None)
def test_occupancy_is_that_of_numpy(
    seed: int, world: tuple[Box, ...], far_m: float, missing: float
) -> None:
    host, device = clouds(*seen(seed, world, far_m, missing))
    planes = (device.x_m, device.y_m, device.z_m)
    np.testing.assert_array_equal(torch.stack(planes, dim=-1), host.points_m)
    np.testing.assert_array_equal(device_flying_pixels(device.depth_m), flying_pixels(host.depth_m))
    for params in (scenes.params(compiled=compiled) for compiled in (False, True)):
        floor, expected_floor = device_floor(device, params), floor_points(host, params)
        for name in ("seen", "drops", "blind"):
            np.testing.assert_array_equal(getattr(floor, name), getattr(expected_floor, name))
        found, expected = device_occupancy(device, params), occupancy_update(host, params)
        for name in ("cells", "evidence", "clear", "blind"):
            np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_thinned_images_give_the_same_occupancy() -> None:
    host, device = clouds(*seen(3, WORLDS[0], 0.0, 0.1))
    for compiled in (False, True):
        params = scenes.params(compiled=compiled, occupancy_max_rows=30)
        found, expected = device_occupancy(device, params), occupancy_update(host, params)
        for name in ("cells", "evidence", "clear", "blind"):
            np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
