"""The update of the map's cells by one frame.

A pure function of the field and the parameters, so it runs without the map's lock. On the host it
is computed by compiled code, on the device by torch; where nothing can be compiled the host is a
device too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from onemap_mapper import jit
from onemap_mapper.frame.blur import blur_kernel, blurred
from onemap_mapper.frame.camera_check import DepthDiagnostics, camera_view, diagnose_depth
from onemap_mapper.frame.cloud import PointCloud, divided
from onemap_mapper.frame.projection import CellWeights, cell_features, project, project_compiled
from onemap_mapper.occupancy.evidence import OccupancyUpdate
from onemap_mapper.occupancy.heights import cell_heights
from onemap_mapper.occupancy.image import occupancy_update
from onemap_mapper.params import MapParams
from onemap_shared.geometry import F32, F64
from onemap_shared.messages import CameraView, FeatureField


@dataclass(frozen=True, slots=True)
class FrameUpdate:
    """The observation of one frame, per cell, on the device of the map, ready to be fused.

    cells (n, 2) int64 world cells with features (n, D) and confidence (n,) float32; heights
    (n, LEVELS) float32: shares of confidence by level of height; depth is None if not diagnosed.
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
    depth: DepthDiagnostics | None
    camera: CameraView

    @property
    def camera_m(self) -> F64:
        """The camera's position (3,) in the map frame."""
        position: F64 = self.T_map_camera[:3, 3]
        return position


def compute_update(field: FeatureField, params: MapParams, *, diagnose: bool = True) -> FrameUpdate:
    """Project, blur and diagnose a field: the expensive half of fusing a frame."""
    dimension, device = field.features.shape[2], params.torch_device
    depth_m = np.divide(field.depth_mm, 1000, dtype=np.float32)  # 0 = no return
    n = -(-len(depth_m) // params.occupancy_max_rows)  # of so many rows and columns one is read
    seen = PointCloud.of(
        depth_m, intrinsics=field.intrinsics, T_map_camera=field.T_map_camera, stride=n
    )
    if jit.usable(wanted=params.compiled, device=device):
        cloud, weights = seen, _weights_on_host(field, depth_m, params)
        variance = torch.from_numpy(field.variance[::n, ::n].copy())
        patches = torch.tensor(field.features, dtype=torch.float32)
    else:
        variance = torch.tensor(field.variance, device=device)
        cloud, weights = _on_device(field, variance, params)
        cloud, variance = cloud.strided(n, n), variance[::n, ::n]
        patches = torch.tensor(field.features, device=device).float()
    cells, features, confidence = _blurred(
        weights, cell_features(weights, patches.view(-1, dimension)), field.T_map_camera, params
    )
    return FrameUpdate(
        sequence=field.sequence,
        stamp_ns=field.stamp_ns,
        encoder_id=field.encoder_id,
        text_space=field.text_space,
        T_map_camera=field.T_map_camera,
        cells=cells,
        features=features,
        confidence=confidence,
        heights=cell_heights(cloud, variance, cells, params),
        occupancy=occupancy_update(cloud, params),
        depth=diagnose_depth(seen) if diagnose else None,
        camera=camera_view(field),
    )


def _weights_on_host(field: FeatureField, depth_m: F32, params: MapParams) -> CellWeights:
    h, w, _ = field.features.shape
    return project_compiled(
        depth_m,
        field.variance,
        intrinsics=field.intrinsics,
        T_map_camera=field.T_map_camera,
        patch_shape=(h, w),
        params=params,
    )


def _on_device(
    field: FeatureField, variance: Tensor, params: MapParams
) -> tuple[PointCloud, CellWeights]:
    """The points and the weights of images that are sent there: 6 bytes per pixel."""
    device, (h, w, _) = params.torch_device, field.features.shape
    millimetres = torch.tensor(field.depth_mm.view(np.int16), device=device).int() & 0xFFFF
    cloud = PointCloud.of(
        divided(millimetres.float(), 1000),
        intrinsics=field.intrinsics,
        T_map_camera=field.T_map_camera,
    )
    return cloud, project(cloud, variance, patch_shape=(h, w), params=params)


def _blurred(
    weights: CellWeights, features: Tensor, T_map_camera: F64, params: MapParams
) -> tuple[Tensor, Tensor, Tensor]:
    """Cells (n, 2), features (n, D) and confidences (n,) of a frame with the blur of its cells."""
    if params.blur_half_width_cells == 0:
        return weights.cells, features, weights.confidence
    x_m, y_m = T_map_camera[:2, 3].tolist()
    kernel = blur_kernel(weights.cells, camera_xy_m=(x_m, y_m), params=params)
    return kernel.cells, blurred(kernel, features), blurred(kernel, weights.confidence)
