"""The images of one frame, on the host or on the device, and what is computed of them there.

On the host by compiled code and NumPy, on the device by torch. Where nothing can be compiled the
host is a device too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from onemap_mapper.compiled_projection import project_compiled
from onemap_mapper.device.cloud import DeviceCloud, divided
from onemap_mapper.device.heights import device_heights
from onemap_mapper.device.occupancy import device_occupancy
from onemap_mapper.heights import cell_heights
from onemap_mapper.kernels import jit
from onemap_mapper.occupancy import OccupancyUpdate, occupancy_update
from onemap_mapper.params import MapParams
from onemap_mapper.point_cloud import PointCloud
from onemap_mapper.projection import CellWeights, project
from onemap_mapper.transfers import CPU
from onemap_shared.geometry import F32
from onemap_shared.messages import FeatureField


class FrameImages(Protocol):
    """Depth and variance of one frame; all results are on the device of the map."""

    @property
    def cloud(self) -> PointCloud:
        """The points, thinned to the rows that occupancy reads, on the host."""
        ...

    def weights(self) -> CellWeights:
        """The weights of the field's patches in the cells of its pixels."""
        ...

    def heights(self, cells: Tensor) -> Tensor:
        """Shares of height of these cells, as ``cell_heights``."""
        ...

    def occupancy(self) -> OccupancyUpdate:
        """The evidence of free and occupied cells."""
        ...


def images_of(field: FeatureField, params: MapParams) -> FrameImages:
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
        compiled=jit.usable(wanted=params.compiled, device=CPU),
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
        """As ``FrameImages.weights``."""
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
        """As ``FrameImages.heights``."""
        n = _thinning(len(self.depth_m), self.params)
        variance = self.field.variance[::n, ::n]
        return torch.from_numpy(cell_heights(self.cloud, variance, cells.numpy(), self.params))

    def occupancy(self) -> OccupancyUpdate:
        """As ``FrameImages.occupancy``."""
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
        """As ``FrameImages.weights``."""
        return project(self.points, self.variance, patch_shape=self.patch_shape, params=self.params)

    def heights(self, cells: Tensor) -> Tensor:
        """As ``FrameImages.heights``."""
        n = _thinning(len(self.variance), self.params)
        points, variance = self.points.strided(n, n), self.variance[::n, ::n]
        return device_heights(points, variance, cells, self.params)

    def occupancy(self) -> OccupancyUpdate:
        """As ``FrameImages.occupancy``."""
        return device_occupancy(self.points, self.params)
