"""The parts of fusing one frame, timed one by one, and what they move and compute."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.blur import BlurKernel, blur_kernel, blurred
from onemap_mapper.frame.camera_check import diagnose_depth
from onemap_mapper.frame.projection import CellWeights, cell_features
from onemap_mapper.frame.update import compute_update, images_of
from onemap_mapper.params import MapParams
from onemap_shared.messages import FeatureField
from onemap_tools.bench.machine import best_s, wall_clock


@dataclass(frozen=True, slots=True)
class FusionWork:
    """What fusing one frame moves, in bytes, and computes, in multiplications and additions.

    Each array that it needs or leaves counts once, each row of the map twice.
    """

    moved_bytes: int
    operations: int


def parts_ms(field: FeatureField, params: MapParams) -> dict[str, float]:
    """Milliseconds of each part, the best of several runs, its inputs in the cache.

    cloud: metres and points from the images, and sending these to a GPU.
    """
    weights, kernel, patches = _prepared(field, params)
    observed = cell_features(weights, patches)
    images, update = images_of(field, params), compute_update(field, params)
    belief, clock = BeliefMap(params), wall_clock(params.torch_device)
    parts: dict[str, Callable[[], object]] = {
        "projection": images.weights,
        "mix": lambda: cell_features(weights, _patches(field, params)),
        "blur": lambda: (
            blur_kernel(weights.cells, camera_xy_m=_camera_xy_m(field), params=params),
            blurred(kernel, observed),
            blurred(kernel, weights.confidence),
        ),
        "cloud": lambda: images_of(field, params),
        "heights": lambda: images.heights(update.cells),
        "occupancy": images.occupancy,
        "diagnostics": lambda: diagnose_depth(images.cloud),
        "absorb": lambda: belief.fuse(update),
    }
    return {name: round(best_s(part, 15, clock) * 1e3, 3) for name, part in parts.items()}


def fusion_work(field: FeatureField, params: MapParams) -> FusionWork:
    """What fusing this frame moves and computes at least."""
    weights, kernel, patches = _prepared(field, params)
    row_bytes = 4 * field.features.shape[2]
    read = sum(array.nbytes for array in (field.depth_mm, field.variance, field.features))
    matrices = 12 * (len(weights.values) + len(kernel.values))
    rows = row_bytes * (len(patches) + 2 * len(weights.cells) + (1 + 2) * len(kernel.cells))
    entries = len(weights.values) + len(kernel.values)
    return FusionWork(read + matrices + rows, 2 * entries * field.features.shape[2])


def _prepared(
    field: FeatureField, params: MapParams
) -> tuple[CellWeights, BlurKernel, torch.Tensor]:
    weights = images_of(field, params).weights()
    kernel = blur_kernel(weights.cells, camera_xy_m=_camera_xy_m(field), params=params)
    return weights, kernel, _patches(field, params)


def _patches(field: FeatureField, params: MapParams) -> torch.Tensor:
    features = torch.tensor(field.features, device=params.torch_device)
    return features.view(-1, field.features.shape[2]).float()


def _camera_xy_m(field: FeatureField) -> tuple[float, float]:
    x_m, y_m = np.asarray(field.T_map_camera[:2, 3], np.float64).tolist()
    return x_m, y_m
