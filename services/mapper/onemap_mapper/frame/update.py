"""The update of the map's cells by one frame.

A pure function of the field and the parameters, so it runs without the map's lock. On the host it
is computed by compiled code and NumPy, on the device by torch; where nothing can be compiled the
host is a device too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from onemap_mapper import jit
from onemap_mapper.frame.blur import blur_kernel, blurred
from onemap_mapper.frame.camera_check import DepthDiagnostics, camera_view, diagnose_depth
from onemap_mapper.frame.cloud import DeviceCloud, PointCloud, divided
from onemap_mapper.frame.projection import CellWeights, cell_features, project, project_compiled
from onemap_mapper.occupancy.evidence import OccupancyUpdate
from onemap_mapper.occupancy.heights import cell_heights, device_heights
from onemap_mapper.occupancy.host import occupancy_update
from onemap_mapper.occupancy.on_device import device_occupancy
from onemap_mapper.params import MapParams
from onemap_shared.geometry import F32, F64
from onemap_shared.messages import CameraView, FeatureField


def images_of(field: FeatureField, params: MapParams) -> HostImages | DeviceImages:
    """The images of a field, where they are computed."""
    depth_m = depth_in_metres(field)
    cloud = cloud_of(field, depth_m, params)
    if jit.usable(wanted=params.compiled, device=params.torch_device):
        return HostImages(field, depth_m, cloud, params)
    return DeviceImages.of(field, cloud, params)


def depth_in_metres(field: FeatureField) -> F32:
    """z-depth (H, W) float32 in metres, 0 = no return."""
    return np.divide(field.depth_mm, 1000, dtype=np.float32)


def cloud_of(field: FeatureField, depth_m: F32, params: MapParams) -> PointCloud:
    """The points of the field, thinned to the rows that occupancy reads."""
    return PointCloud.of(
        depth_m,
        intrinsics=field.intrinsics,
        T_map_camera=field.T_map_camera,
        stride=_thinning(len(depth_m), params),
    )


def _thinning(rows: int, params: MapParams) -> int:
    """Of how many rows and columns of an image one is in its cloud."""
    return -(-rows // params.occupancy_max_rows)


@dataclass(frozen=True, slots=True)
class HostImages:
    """Images on the host: depth_m (H, W) float32 metres, and the points, thinned."""

    field: FeatureField
    depth_m: F32
    cloud: PointCloud
    params: MapParams

    def weights(self) -> CellWeights:
        """The weights of the field's patches in the cells of its pixels."""
        h, w, _ = self.field.features.shape
        return project_compiled(
            self.depth_m,
            self.field.variance,
            intrinsics=self.field.intrinsics,
            T_map_camera=self.field.T_map_camera,
            patch_shape=(h, w),
            params=self.params,
        )

    def heights(self, cells: Tensor) -> Tensor:
        """Shares of height of these cells."""
        n = _thinning(len(self.depth_m), self.params)
        variance = self.field.variance[::n, ::n]
        return torch.from_numpy(cell_heights(self.cloud, variance, cells.numpy(), self.params))

    def occupancy(self) -> OccupancyUpdate:
        """The evidence of free and occupied cells."""
        return occupancy_update(self.cloud, self.params)


@dataclass(frozen=True, slots=True)
class DeviceImages:
    """Images on the device: variance (H, W) and the points of all pixels; patch_shape: (h, w).

    cloud: the points, thinned, on the host, where the camera is diagnosed.
    """

    cloud: PointCloud
    points: DeviceCloud
    variance: Tensor
    patch_shape: tuple[int, int]
    params: MapParams

    @classmethod
    def of(cls, field: FeatureField, cloud: PointCloud, params: MapParams) -> DeviceImages:
        """The images of a field, which are sent to the device: 6 bytes per pixel."""
        device = params.torch_device
        millimetres = torch.tensor(field.depth_mm.view(np.int16), device=device).int() & 0xFFFF
        points = DeviceCloud.of(
            divided(millimetres.float(), 1000),
            intrinsics=field.intrinsics,
            T_map_camera=field.T_map_camera,
        )
        h, w, _ = field.features.shape
        variance = torch.tensor(field.variance, device=device)
        return cls(cloud, points, variance, (h, w), params)

    def weights(self) -> CellWeights:
        """The weights of the field's patches in the cells of its pixels."""
        return project(self.points, self.variance, patch_shape=self.patch_shape, params=self.params)

    def heights(self, cells: Tensor) -> Tensor:
        """Shares of height of these cells."""
        n = _thinning(len(self.variance), self.params)
        points, variance = self.points.strided(n, n), self.variance[::n, ::n]
        return device_heights(points, variance, cells, self.params)

    def occupancy(self) -> OccupancyUpdate:
        """The evidence of free and occupied cells."""
        return device_occupancy(self.points, self.params)


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
    camera: CameraView

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
        depth=diagnose_depth(images.cloud),
        camera=camera_view(field),
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
