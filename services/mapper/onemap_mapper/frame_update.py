"""The update of the map's cells by one frame.

A pure function of the field and the parameters, so it runs without the map's lock.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from onemap_mapper.blur import blur_kernel, blurred
from onemap_mapper.diagnostics.depth_diagnostics import DepthDiagnostics, diagnose_depth
from onemap_mapper.frame_images import images_of
from onemap_mapper.kernels import jit
from onemap_mapper.occupancy import OccupancyUpdate
from onemap_mapper.params import MapParams
from onemap_mapper.projection import CellWeights, cell_features
from onemap_mapper.transfers import CPU
from onemap_shared.geometry import F64
from onemap_shared.messages import FeatureField


@dataclass(frozen=True, slots=True)
class FrameUpdate:
    """The observation of one frame, per cell, on the device of the map, ready to be fused.

    cells (n, 2) int64 world cells with features (n, D) and confidence (n,) float32; heights
    (n, LEVELS) float32: shares of confidence by level of height.
    """

    sequence: int
    stamp_ns: int
    encoder_id: str
    text_space: str
    T_map_camera: F64
    cells: Tensor
    features: Tensor
    confidence: Tensor
    heights: Tensor
    occupancy: OccupancyUpdate
    depth: DepthDiagnostics

    @property
    def camera_m(self) -> F64:
        """The camera's position (3,) in the map frame."""
        position: F64 = self.T_map_camera[:3, 3]
        return position


def compute_update(field: FeatureField, params: MapParams) -> FrameUpdate:
    """Project, blur and diagnose a field: the expensive half of fusing a frame."""
    images = images_of(field, params)
    weights = images.weights()
    dimension, device = field.features.shape[2], params.torch_device
    patches = torch.tensor(field.features, device=device).view(-1, dimension).float()
    cells, features, confidence = _blurred(
        weights, cell_features(weights, patches), images.cloud.camera_m, params
    )
    compiled = jit.usable(wanted=params.compiled, device=CPU)
    return FrameUpdate(
        sequence=field.sequence,
        stamp_ns=field.stamp_ns,
        encoder_id=field.encoder_id,
        text_space=field.text_space,
        T_map_camera=field.T_map_camera,
        cells=cells,
        features=features,
        confidence=confidence,
        heights=images.heights(cells),
        occupancy=images.occupancy(),
        depth=diagnose_depth(images.cloud, compiled=compiled),
    )


def _blurred(
    weights: CellWeights, features: Tensor, camera_m: F64, params: MapParams
) -> tuple[Tensor, Tensor, Tensor]:
    """Cells (n, 2), features (n, D) and confidences (n,) of a frame with the blur of its cells."""
    if params.blur_half_width_cells == 0:
        return weights.cells, features, weights.confidence
    x_m, y_m = (float(value) for value in camera_m[:2])
    kernel = blur_kernel(weights.cells, camera_xy_m=(x_m, y_m), params=params)
    return kernel.cells, blurred(kernel, features), blurred(kernel, weights.confidence)
