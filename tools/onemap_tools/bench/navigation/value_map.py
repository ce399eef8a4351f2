"""VLFM's value map: one score per cell for one query, weighted by a confidence cone.

Yokoyama et al. (2023), "VLFM: Vision-Language Frontier Maps": the cosine of the whole image and
the text is written to all cells in view; the confidence is cos^2 of the angle to the optical axis,
scaled to 0 at the edge of the image. The image's embedding is the mean of its patches' features.
"""

from __future__ import annotations

import numpy as np

from onemap_shared.camera import ray_directions, unproject_to_map
from onemap_shared.geometry import F32, F64
from onemap_shared.grid import GridSpec
from onemap_shared.messages import FeatureField, SearchView, TextEmbeddings

EXTENT_M = 80.0  # side of the map, around the origin: any apartment
RANGE_M = 8.0  # the camera's; a wall nearer than this ends the view


class ConfidenceValueMap:
    """Implements ``ValueMap``."""

    def __init__(self, cell_size_m: float) -> None:
        half = round(EXTENT_M / 2 / cell_size_m)
        self._grid = GridSpec(cell_size_m, (-half, -half), (2 * half, 2 * half))
        self.clear()

    def clear(self) -> None:
        """Forget all frames."""
        self._value = np.zeros(self._grid.shape, np.float32)
        self._confidence = np.zeros(self._grid.shape, np.float32)

    def add(self, field: FeatureField, query: TextEmbeddings) -> None:
        """Write the image's score to the cells in view; weights are confidences (VLFM, Eq. 2)."""
        score = image_score(field, query)
        camera = field.T_map_camera[:2, 3]
        corner = self._grid.cells(camera - RANGE_M)
        low = np.clip(corner, 0, self._grid.shape)
        high = np.clip(self._grid.cells(camera + RANGE_M) + 1, 0, self._grid.shape)
        box = (slice(low[0], high[0]), slice(low[1], high[1]))
        cells = np.argwhere(np.ones(high - low, bool)).reshape(*(high - low), 2) + low
        new = view_confidence(self._grid.centres(cells), field)
        old = self._confidence[box]
        total = np.maximum(old + new, np.float32(1e-9))
        seen = new > 0
        value = (old * self._value[box] + new * score) / total
        self._value[box] = np.where(seen, value, self._value[box])
        self._confidence[box] = np.where(seen, (old**2 + new**2) / total, old)

    def view(self, view: SearchView) -> SearchView:
        """The view with the values where the map has any, and no competing names."""
        first = np.asarray(view.grid.origin_cell) - np.asarray(self._grid.origin_cell)
        cells = np.argwhere(np.ones(view.grid.shape, bool)).reshape(*view.grid.shape, 2) + first
        inside = self._grid.contains(cells)
        x, y = np.moveaxis(np.clip(cells, 0, np.asarray(self._grid.shape) - 1), -1, 0)
        known = inside & (self._confidence[x, y] > 0)
        return scored_view(view, np.where(known, self._value[x, y], np.float32(np.nan)))


def scored_view(view: SearchView, similarity: F32) -> SearchView:
    """The layers of a view with this similarity (nx, ny), without what else words decide."""
    return SearchView(
        text=view.text,
        revision=view.revision,
        sequence=view.sequence,
        stamp_ns=view.stamp_ns,
        grid=view.grid,
        occupancy=view.occupancy,
        layers=view.layers,
        similarity=similarity,
    )


def image_score(field: FeatureField, query: TextEmbeddings) -> float:
    """(1 + cosine) / 2 of the mean feature and the query's first text."""
    mean = field.features.astype(np.float32).mean(axis=(0, 1))
    cosine = float(mean @ query.embeddings[0]) / max(float(np.linalg.norm(mean)), 1e-6)
    return (1 + cosine) / 2


def view_confidence(places_m: F64, field: FeatureField) -> F32:
    """Confidence (...) of places (..., 2) in metres: 0 where the image does not show them."""
    bearings, ranges_m = column_ranges(field)
    apart = places_m - field.T_map_camera[:2, 3]
    axis = field.T_map_camera[:2, 2]
    ahead = apart @ axis
    left = apart @ np.array([-axis[1], axis[0]])
    angle = np.arctan2(left, ahead)
    half = np.abs(bearings).max()
    reach_m = np.interp(angle, bearings, ranges_m)
    seen = (np.abs(angle) <= half) & (np.hypot(ahead, left) <= reach_m)
    cone = np.cos(angle / half * np.pi / 2) ** 2
    confidence: F32 = np.where(seen, cone, 0.0).astype(np.float32)
    return confidence


def column_ranges(field: FeatureField) -> tuple[F64, F64]:
    """Bearing from the optical axis, ascending (W,), and farthest floor distance (W,) of columns.

    A column without any depth has range 0.
    """
    height, width = field.depth_mm.shape
    rays = ray_directions(field.intrinsics, width, height)[height // 2].astype(np.float64)
    directions = rays @ field.T_map_camera[:3, :3].T
    axis = field.T_map_camera[:2, 2]
    bearings = np.arctan2(
        axis[0] * directions[:, 1] - axis[1] * directions[:, 0], directions[:, :2] @ axis
    )
    depth_m = np.divide(field.depth_mm, 1000, dtype=np.float32)
    points = unproject_to_map(depth_m, field.intrinsics, field.T_map_camera)
    away = np.hypot(*(points[..., :2] - field.T_map_camera[:2, 3]).reshape(-1, 2).T)
    ranges = np.where(field.depth_mm > 0, away.reshape(height, width), 0.0).max(axis=0)
    order = np.argsort(bearings)
    return bearings[order], np.minimum(ranges[order], RANGE_M).astype(np.float64)
