"""The map update as the equations read: the upsampled image, double loops, a dense map."""

from __future__ import annotations

import math

import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, I64, transform

Cells = dict[tuple[int, int], tuple[F64, float]]  # cell -> feature (D,), confidence


def upsampled(features: F32, height: int, width: int) -> F64:
    """Features (h, w, D) bilinearly at every pixel: the (H, W, D) image that the mapper avoids."""
    h, w, channels = features.shape
    image = np.zeros((height, width, channels))
    for v in range(height):
        y = min(max((v + 0.5) * h / height - 0.5, 0.0), h - 1.0)
        for u in range(width):
            x = min(max((u + 0.5) * w / width - 0.5, 0.0), w - 1.0)
            top, left = math.floor(y), math.floor(x)
            for i, j in ((top, left), (top, left + 1), (top + 1, left), (top + 1, left + 1)):
                share = max(0.0, 1 - abs(y - i)) * max(0.0, 1 - abs(x - j))
                if share > 0:
                    image[v, u] += share * features[i, j]
    return image


def cell_of(point: F64, cell_size_m: float) -> tuple[int, int]:
    """The world cell of a point, by the definition."""
    return math.floor(point[0] / cell_size_m), math.floor(point[1] / cell_size_m)


def projected(
    features: F32,
    depth_m: F32,
    variance: F32,
    *,
    intrinsics: Intrinsics,
    T_map_camera: F64,
    cell_size_m: float,
) -> Cells:
    """F_M and c_M: the weighted mean feature and the mean weight of each cell's pixels."""
    image = upsampled(features, *depth_m.shape)
    pixels: dict[tuple[int, int], list[tuple[F64, float]]] = {}
    for (v, u), depth in np.ndenumerate(depth_m.astype(np.float64)):
        if depth == 0 or not np.isfinite(variance[v, u]):
            continue
        ray = np.array([intrinsics.x_at(float(u)), intrinsics.y_at(float(v)), 1.0])
        point = transform(T_map_camera, depth * ray)
        s = 1 / float(variance[v, u])
        pixels.setdefault(cell_of(point, cell_size_m), []).append((image[v, u], s))
    cells: Cells = {}
    for cell, seen in pixels.items():
        total = sum(s for _, s in seen)
        mean = np.sum([s * f for f, s in seen], axis=0) / total
        cells[cell] = (mean, total / len(seen))
    return cells


def blurred(
    cells: Cells,
    *,
    camera_xy_m: tuple[float, float],
    cell_size_m: float,
    depth_factor: float,
    half_width: int,
) -> Cells:
    """F-bar_i and c-bar_i over the whole window; unobserved cells count as zero."""
    window = range(-half_width, half_width + 1)
    result: Cells = {}
    for x, y in {(x + i, y + j) for x, y in cells for i in window for j in window}:
        distance = math.hypot(x * cell_size_m - camera_xy_m[0], y * cell_size_m - camera_xy_m[1])
        sigma = max(depth_factor * distance / cell_size_m, 1e-3)
        total, confidence = 0.0, 0.0
        feature = np.zeros_like(next(iter(cells.values()))[0])
        for i in window:
            for j in window:
                weight = math.exp(-(i * i + j * j) / (2 * sigma**2))
                total += weight
                if (x + i, y + j) in cells:
                    f, c = cells[(x + i, y + j)]
                    feature = feature + weight * f
                    confidence += weight * c
        result[(x, y)] = (feature / total, confidence / total)
    return result


def fused(frames: list[Cells]) -> Cells:
    """Eqs. bayes1-3 in variance form, cell by cell, frame by frame."""
    belief: Cells = {}
    for frame in frames:
        for cell, (new, c_new) in frame.items():
            if c_new <= 0:
                continue
            if cell not in belief:
                belief[cell] = (new, c_new)
                continue
            old, c = belief[cell]
            K = (1 / c) / (1 / c + 1 / c_new)
            belief[cell] = (old + K * (new - old), 1 / ((1 - K) / c))
    return belief


def table(cells: Cells, order: I64) -> tuple[F64, F64]:
    """Features (n, D) and confidences (n,) in this order of cells (n, 2)."""
    rows = [cells[(int(x), int(y))] for x, y in order]
    return np.array([f for f, _ in rows]), np.array([c for _, c in rows])


def fading_mean(observations: F64, confidence: float, max_prior: float) -> F64:
    """The belief (frames, D) float64 after each of the observations (frames, D) of one cell.

    As ``fused`` with variances, but what was known before counts for ``max_prior`` at most.
    """
    means, known = np.zeros_like(observations), 0.0
    for k, new in enumerate(observations):
        prior = min(known, max_prior)
        before = means[k - 1] if k else np.zeros_like(new)
        means[k] = (prior * before + confidence * new) / (prior + confidence)
        known += confidence
    return means


def unproject(depth_m: F32, intrinsics: Intrinsics) -> F32:
    """Camera-frame points (H, W, 3) float32, metres, of z-depth (H, W); depth 0 is the origin."""
    height, width = depth_m.shape
    points = np.empty((height, width, 3), np.float32)
    points[..., 0] = depth_m * intrinsics.x_at(np.arange(width, dtype=np.float32))
    points[..., 1] = depth_m * intrinsics.y_at(np.arange(height, dtype=np.float32))[:, None]
    points[..., 2] = depth_m
    return points
