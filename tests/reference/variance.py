"""The observation variance, pixel by pixel in plain loops."""

from __future__ import annotations

import math

import numpy as np

from onemap_perception.feature_field import VarianceFormula, VarianceParams
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64


def variance(depth_m: F32, intrinsics: Intrinsics, params: VarianceParams) -> F64:
    """Variance (H, W) float64, infinity where there is no depth or too little confidence."""
    depth = np.where(np.isfinite(depth_m) & (depth_m > 0), depth_m, np.nan).astype(np.float64)
    released = params.formula is VarianceFormula.RELEASED
    confidence = _released(depth, intrinsics, params) if released else _paper(depth, params)
    result = np.full(depth.shape, np.inf)
    for pixel in np.ndindex(depth.shape):
        if confidence[pixel] >= params.min_confidence:
            result[pixel] = 1 / confidence[pixel]
    return result


def _released(depth: F64, intrinsics: Intrinsics, params: VarianceParams) -> F64:
    height, width = depth.shape
    nearest = np.full(depth.shape, np.nan)
    for v, u in np.ndindex(depth.shape):
        seen = [x for x in _window(depth, v, u) if not math.isnan(x)]
        nearest[v, u] = min(seen) if seen else math.nan
    steepness = np.zeros(depth.shape)
    for v, u in np.ndindex(depth.shape):
        du = _derivative(nearest[v, :], u) * width / intrinsics.fx
        dv = _derivative(nearest[:, u], v) * height / intrinsics.fy
        steepness[v, u] = math.sqrt(du**2 + dv**2)
    confidence = np.zeros(depth.shape)
    for v, u in np.ndindex(depth.shape):
        leakage = 1 - math.tanh(params.gradient_factor * max(_window(steepness, v, u)))
        offset = (params.optimal_distance_m - depth[v, u]) / params.distance_factor_m
        confidence[v, u] = leakage * math.exp(-(offset**2) / 3)
    return confidence


def _paper(depth: F64, params: VarianceParams) -> F64:
    confidence = np.zeros(depth.shape)
    for v, u in np.ndindex(depth.shape):
        du, dv = _derivative(depth[v, :], u), _derivative(depth[:, u], v)
        leakage = params.epsilon + math.tanh(du**2 + dv**2)
        distance = math.exp(((params.optimal_distance_m - depth[v, u]) / 2) ** 2)
        confidence[v, u] = 1 / (leakage * distance)
    return confidence


def _window(image: F64, v: int, u: int) -> list[float]:
    patch: list[float] = image[max(v - 5, 0) : v + 6, max(u - 5, 0) : u + 6].ravel().tolist()
    return patch


def _derivative(line: F64, i: int) -> float:
    if len(line) < 2:
        return 0.0
    before, after = max(i - 1, 0), min(i + 1, len(line) - 1)
    slope = float((line[after] - line[before]) / (after - before))
    return 0.0 if math.isnan(slope) else slope
