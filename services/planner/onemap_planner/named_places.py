"""Where a drive to a place ends that has a name."""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.grid import GridSpec
from onemap_shared.messages import Place
from onemap_shared.places import polygon_mask

POINTS = 100  # that are tried along a polygon, for the one farthest from its edges


def goal_m(place: Place) -> tuple[float, ...]:
    """x, y of the point by which a room is named, or of one well inside a polygon."""
    return inner_point_m(place.corners_m) if place.corners_m else place.inside_m


def inner_point_m(corners_m: tuple[tuple[float, float], ...]) -> tuple[float, float]:
    """x, y inside a polygon, about as far from its edges as any: the mean of its corners may lie
    outside. Where it is thinner than a hundredth of its length it is that mean.
    """
    corners = np.array(corners_m, np.float64)
    (x0, y0), (x1, y1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    grid = GridSpec.covering(max(x1 - x0, y1 - y0) / POINTS, (x0, y0), (x1, y1))
    mask = np.pad(polygon_mask(corners, grid), 1).astype(np.uint8)
    depth = cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1]
    mean_m = corners.mean(axis=0)
    inmost = grid.centres(np.argwhere((depth > 0) & (depth >= depth.max() - 1)))
    nearest = min(
        inmost, key=lambda point_m: float(np.linalg.norm(point_m - mean_m)), default=mean_m
    )
    x_m, y_m = nearest.tolist()
    return x_m, y_m
