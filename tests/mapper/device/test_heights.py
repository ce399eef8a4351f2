"""Shares of height by torch, against NumPy."""

from __future__ import annotations

import numpy as np
import torch
from hypothesis import settings

from onemap_mapper.occupancy.heights import cell_heights, device_heights
from onemap_shared.grid import world_cells
from tests.mapper import scenes
from tests.mapper.device.frames import IMAGES, clouds, seen
from tests.mapper.scenes import Box


@IMAGES
@settings(max_examples=15, deadline=None)
def test_heights_are_those_of_numpy(
    seed: int, world: tuple[Box, ...], far_m: float, missing: float
) -> None:
    rng, (depth, T) = np.random.default_rng(seed), seen(seed, world, far_m, missing)
    host, device = clouds(depth, T)
    variance = rng.uniform(0.5, 400, depth.shape).astype(np.float32)
    variance[rng.random(depth.shape) < 0.1] = np.inf
    params = scenes.params(compiled=False)
    cells = np.unique(world_cells(host.points_m.reshape(-1, 3), params.cell_size_m), axis=0)
    cells = cells[rng.permutation(len(cells))[: rng.integers(0, len(cells) + 1)]]
    found = device_heights(device, torch.from_numpy(variance), torch.from_numpy(cells), params)
    np.testing.assert_allclose(found, cell_heights(host, variance, cells, params), atol=1e-6)
