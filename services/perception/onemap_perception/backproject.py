"""Points in the map of detections in the image, through the depth image."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onemap_perception.detectors.protocol import Detection
from onemap_shared.geometry import F32, I32, Bool, transform
from onemap_shared.messages import RgbdFrame

MILLIMETRE_M = np.float32(1e-3)
MAX_POINTS = 64  # per detection: enough for the planner's consensus, small on the wire
MAX_DEPTH_SPREAD_M = 0.6  # half the depth of a sofa; what lies deeper is behind the object


def backproject_detections(detections: Sequence[Detection], frame: RgbdFrame) -> tuple[F32, I32]:
    """Surface points (P, 3) float32 of all detections in the map frame and their owners (P,).

    Per detection at most ``MAX_POINTS``, evenly spread over its mask, without those whose depth
    is more than ``MAX_DEPTH_SPREAD_M`` from the detection's median.
    """
    points = [np.zeros((0, 3), np.float32)]
    owners = [np.zeros(0, np.int32)]
    for index, detection in enumerate(detections):
        own = _backproject_mask(detection.mask, frame)
        points.append(own)
        owners.append(np.full(len(own), index, np.int32))
    return np.concatenate(points), np.concatenate(owners)


def _backproject_mask(mask: Bool, frame: RgbdFrame) -> F32:
    """Points (N, 3) float32 under one mask (h, w) that is laid over the whole image."""
    height, width = frame.depth_mm.shape
    row_of = np.arange(height) * mask.shape[0] // height
    column_of = np.arange(width) * mask.shape[1] // width
    covered = mask[row_of[:, None], column_of[None, :]] & (frame.depth_mm > 0)
    v, u = np.nonzero(covered)
    if len(v) == 0:
        return np.zeros((0, 3), np.float32)
    depth_m = frame.depth_mm[v, u] * MILLIMETRE_M
    near = np.flatnonzero(np.abs(depth_m - np.median(depth_m)) <= MAX_DEPTH_SPREAD_M)
    kept = near[np.linspace(0, len(near) - 1, min(MAX_POINTS, len(near))).round().astype(int)]
    x, y = frame.intrinsics.x_at(u[kept]), frame.intrinsics.y_at(v[kept])
    points_camera = np.stack([x, y, np.ones(len(kept))], axis=1)
    points_camera *= depth_m[kept, None]
    points_map: F32 = transform(frame.T_map_camera, points_camera).astype(np.float32)
    return points_map
