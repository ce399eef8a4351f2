"""The update of the map's cells by one frame.

A pure function of the field and the parameters, so it runs without the map's lock. Compiled code
computes on the host where the pixels lie. Only the features are multiplied on the device of the
map: patches and sparse weights are sent there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from onemap_mapper.frame.blur import blur_kernel
from onemap_mapper.frame.camera_check import DepthDiagnostics, camera_view, diagnose_depth
from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.frame.projection import SparseRows, project
from onemap_mapper.occupancy.evidence import OccupancyUpdate
from onemap_mapper.occupancy.heights import cell_heights
from onemap_mapper.occupancy.image import occupancy_update
from onemap_mapper.params import MapParams
from onemap_shared.colours import unpacked
from onemap_shared.geometry import F32, F64, I64, U8
from onemap_shared.messages import CameraView, FeatureField


@dataclass(frozen=True, slots=True)
class FrameUpdate:
    """The observation of one frame, per cell, ready to be fused.

    cells (n, 2) int64 world cells with features (n, D) float32, on the device of the map, and
    confidence (n,) float32; heights (n, LEVELS) float32: shares of confidence by level of height;
    colours (n, 3) float32: Lab, (0, 3) if the field has none; depth is None if not diagnosed.
    """

    sequence: int
    stamp_ns: int
    encoder_id: str
    text_space: str
    T_map_camera: F64
    cells: I64
    features: Tensor
    confidence: F32
    heights: F32
    colours: F32
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
    depth_m = np.divide(field.depth_mm, 1000, dtype=np.float32)  # 0 = no return
    weights = project(
        depth_m,
        field.variance,
        intrinsics=field.intrinsics,
        T_map_camera=field.T_map_camera,
        patch_shape=field.features.shape[:2],
        params=params,
    )
    h, w, dimension = field.features.shape
    patches = torch.tensor(field.features, device=params.torch_device).float()
    features = weights.rows.times(patches.view(h * w, dimension))
    colours = _colours(field.colours, weights.rows)
    cells, confidence = weights.cells, weights.confidence
    if params.blur_half_width_cells:
        kernel = blur_kernel(cells, camera_xy_m=field.T_map_camera[:2, 3], params=params)
        cells, features = kernel.cells, kernel.rows.times(features)
        confidence = kernel.confidence(confidence)
        colours = kernel.rows.times(colours) if len(colours) else colours
    n = -(-len(depth_m) // params.occupancy_max_rows)  # of so many rows and columns one is read
    cloud = PointCloud.of(
        depth_m, intrinsics=field.intrinsics, T_map_camera=field.T_map_camera, stride=n
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
        heights=cell_heights(cloud, field.variance[::n, ::n].copy(), cells, params),
        colours=(colours[:, :3] / colours[:, 3:]).numpy(),
        occupancy=occupancy_update(cloud, params),
        depth=diagnose_depth(cloud) if diagnose else None,
        camera=camera_view(field),
    )


def _colours(colours: U8, rows: SparseRows) -> Tensor:
    """The product of the rows with the colours of the patches (h, w, 3), and with ones (n, 4):
    rows of the blur sum to less than 1, which divides a mean, as do patches without a colour, which
    are 0 throughout. (0, 4) without colours."""
    if not colours.size:
        return torch.zeros((0, 4))
    lab = np.pad(unpacked(colours.reshape(-1, 3)), ((0, 0), (0, 1)), constant_values=1)
    lab[np.isnan(lab[:, 0])] = 0
    return rows.times(torch.from_numpy(lab))
