"""Detections in the image to points of the map, through the depth image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onemap_perception.detectors.protocol import Detection
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, I32, U16, Bool, transform

MAX_POINTS = 64  # per detection: enough for the planner's consensus, small on the wire
DEPTH_SPREAD_M = 0.6  # deeper than half a sofa behind the median is the wall seen past it
MILLIMETRE_M = np.float32(1e-3)


@dataclass(frozen=True, slots=True)
class DepthView:
    """depth_mm (H, W) uint16, 0 = no return; the camera and its T_map_camera (4, 4)."""

    depth_mm: U16
    intrinsics: Intrinsics
    T_map_camera: F64


def detection_points(found: Sequence[Detection], view: DepthView) -> tuple[F32, I32]:
    """Surface points (P, 3) float32 of all detections in the map frame and their owners (P,).

    Per detection at most 64, evenly spread over its mask, without those whose depth is far
    from the detection's median.
    """
    points = [np.zeros((0, 3), np.float32)]
    owners = [np.zeros(0, np.int32)]
    for index, detection in enumerate(found):
        own = _points(detection.mask, view)
        points.append(own)
        owners.append(np.full(len(own), index, np.int32))
    return np.concatenate(points), np.concatenate(owners)


def _points(mask: Bool, view: DepthView) -> F32:
    """Points (N, 3) float32 under one mask (h, w) that is laid over the whole image."""
    height, width = view.depth_mm.shape
    row_of = np.arange(height) * mask.shape[0] // height
    column_of = np.arange(width) * mask.shape[1] // width
    covered = mask[row_of[:, None], column_of[None, :]] & (view.depth_mm > 0)
    v, u = np.nonzero(covered)
    if len(v) == 0:
        return np.zeros((0, 3), np.float32)
    depth_m = view.depth_mm[v, u] * MILLIMETRE_M
    near = np.flatnonzero(np.abs(depth_m - np.median(depth_m)) <= DEPTH_SPREAD_M)
    kept = near[np.linspace(0, len(near) - 1, min(MAX_POINTS, len(near))).round().astype(int)]
    camera, depth = view.intrinsics, depth_m[kept].astype(np.float64)
    x = (u[kept] + 0.5 - camera.cx) / camera.fx * depth
    y = (v[kept] + 0.5 - camera.cy) / camera.fy * depth
    in_map: F32 = transform(view.T_map_camera, np.stack([x, y, depth], axis=1)).astype(np.float32)
    return in_map
