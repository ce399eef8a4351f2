"""Occupancy by torch, against the compiled loops: bit for bit."""

from __future__ import annotations

import numpy as np
import torch
from hypothesis import settings

from onemap_mapper.occupancy.floor import floor_points
from onemap_mapper.occupancy.host import few_alike, occupancy_update
from onemap_mapper.occupancy.on_device import device_floor, device_flying_pixels, device_occupancy
from tests.mapper import scenes
from tests.mapper.device.frames import IMAGES, WORLDS, clouds, seen
from tests.mapper.scenes import Box

PARAMS = scenes.params()


@IMAGES
@settings(max_examples=30, deadline=None)
def test_occupancy_by_torch_is_that_of_the_compiled_loops(
    seed: int, world: tuple[Box, ...], far_m: float, missing: float
) -> None:
    host, device = clouds(*seen(seed, world, far_m, missing))
    planes = (device.x_m, device.y_m, device.z_m)
    np.testing.assert_array_equal(torch.stack(planes, dim=-1), host.points_m)
    np.testing.assert_array_equal(device_flying_pixels(device.depth_m), few_alike(host.depth_m))
    floor, expected_floor = device_floor(device, PARAMS), floor_points(host, PARAMS)
    for name in ("seen", "drops", "blind"):
        np.testing.assert_array_equal(getattr(floor, name), getattr(expected_floor, name))
    found, expected = device_occupancy(device, PARAMS), occupancy_update(host, PARAMS)
    for name in ("cells", "evidence", "clear", "blind"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_thinned_images_give_the_same_occupancy() -> None:
    host, device = clouds(*seen(3, WORLDS[0], 0.0, 0.1))
    params = scenes.params(occupancy_max_rows=30)
    found, expected = device_occupancy(device, params), occupancy_update(host, params)
    for name in ("cells", "evidence", "clear", "blind"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
