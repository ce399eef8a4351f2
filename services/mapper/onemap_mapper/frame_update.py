"""The update of the map's cells by one frame.

A pure function of the field and the parameters, so it runs without the map's lock.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from onemap_mapper.blur import blur_kernel, blurred
from onemap_mapper.compiled_projection import project_compiled
from onemap_mapper.diagnostics.depth_diagnostics import DepthDiagnostics, diagnose_depth
from onemap_mapper.heights import cell_heights
from onemap_mapper.kernels import jit
from onemap_mapper.occupancy import OccupancyUpdate, occupancy_update
from onemap_mapper.params import MapParams
from onemap_mapper.point_cloud import PointCloud
from onemap_mapper.projection import CellWeights, cell_features, project
from onemap_mapper.transfers import CPU, to_device, to_host
from onemap_shared.geometry import F32, F64
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
    depth_m = depth_in_metres(field)
    weights = weights_of(field, depth_m, params)
    cloud = cloud_of(field, depth_m, params)
    x_m, y_m = (float(value) for value in cloud.camera_m[:2])
    kernel = blur_kernel(weights.cells, camera_xy_m=(x_m, y_m), params=params)
    dimension, device = field.features.shape[2], params.torch_device
    patches = torch.tensor(field.features, device=device).view(-1, dimension).float()
    compiled = jit.usable(wanted=params.compiled, device=CPU)
    stride = thinning(depth_m, params)
    cells = to_host(kernel.cells)
    heights = cell_heights(cloud, field.variance[::stride, ::stride], cells, params)
    return FrameUpdate(
        sequence=field.sequence,
        stamp_ns=field.stamp_ns,
        encoder_id=field.encoder_id,
        text_space=field.text_space,
        T_map_camera=field.T_map_camera,
        cells=kernel.cells,
        features=blurred(kernel, cell_features(weights, patches)),
        confidence=blurred(kernel, weights.confidence),
        heights=to_device(heights, device),
        occupancy=occupancy_update(cloud, params, device),
        depth=diagnose_depth(cloud, compiled=compiled),
    )


def depth_in_metres(field: FeatureField) -> F32:
    """z-depth (H, W) float32 in metres, 0 = no return."""
    return np.divide(field.depth_mm, 1000, dtype=np.float32)


def cloud_of(field: FeatureField, depth_m: F32, params: MapParams) -> PointCloud:
    """The points of the field, thinned to the rows that occupancy reads."""
    return PointCloud.of(
        depth_m,
        intrinsics=field.intrinsics,
        T_map_camera=field.T_map_camera,
        stride=thinning(depth_m, params),
    )


def thinning(depth: NDArray, params: MapParams) -> int:
    """Of how many rows and columns of an image (H, W) one is in its cloud."""
    rows: int = depth.shape[0]
    return -(-rows // params.occupancy_max_rows)


def weights_of(field: FeatureField, depth_m: F32, params: MapParams) -> CellWeights:
    """The weights of the field's patches in the cells of its pixels."""
    h, w, _ = field.features.shape
    intrinsics, T_map_camera = field.intrinsics, field.T_map_camera
    if jit.usable(wanted=params.compiled, device=params.torch_device):
        return project_compiled(
            depth_m,
            field.variance,
            intrinsics=intrinsics,
            T_map_camera=T_map_camera,
            patch_shape=(h, w),
            params=params,
        )
    cloud = PointCloud.of(depth_m, intrinsics=intrinsics, T_map_camera=T_map_camera)
    return project(
        cloud, field.variance, patch_shape=(h, w), params=params, device=params.torch_device
    )
