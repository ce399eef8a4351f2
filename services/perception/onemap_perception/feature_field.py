"""The observation variance: how uncertain the feature of each pixel is, from its depth.

Two formulas of Eq. totalvariance, both the product of a leakage term (at depth edges a patch
mixes two surfaces) and a distance term (objects too near or too far are not recognised).
``RELEASED`` is what the authors' code computes, ``PAPER`` what the paper prints, plus an epsilon
without which flat surfaces would have variance zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import cv2
import numpy as np

from onemap_perception.encoders.protocol import Encoder
from onemap_perception.target_detection import MILLIMETRE_M
from onemap_shared.camera import Intrinsics
from onemap_shared.colours import is_dark, lab_of, packed
from onemap_shared.geometry import F16, F32, Bool
from onemap_shared.messages import FeatureField, RgbdFrame, expect

EDGE_WINDOW_PX = 11  # neighbourhood of a depth edge that gets its variance; as the authors' code
FARTHEST_M = np.float32(1e6)  # stands for "no return" inside the minimum filter


class VarianceFormula(str, Enum):
    """Which of the two formulas."""

    RELEASED = "released"
    PAPER = "paper"


@dataclass(frozen=True, slots=True)
class VarianceParams:
    """Parameters of the observation variance; the numbers are the authors'.

    optimal_distance_m: d_opt, at which objects are recognised best. gradient_factor: k_g, and
    distance_factor_m: f, of ``RELEASED`` only. epsilon: of ``PAPER`` only, the variance of a flat
    surface at the optimal distance. min_confidence: pixels with a lower 1 / variance are unused;
    the mapper refuses variances above 1e12.
    """

    formula: VarianceFormula = VarianceFormula.RELEASED
    optimal_distance_m: float = 1.0
    gradient_factor: float = 0.2
    distance_factor_m: float = 1.5
    epsilon: float = 0.1
    min_confidence: float = 1e-5


def observation_variance(depth_m: F32, intrinsics: Intrinsics, params: VarianceParams) -> F32:
    """Variance (H, W) float32 > 0 of each pixel's feature; infinity = do not use.

    depth_m (H, W) float32 along the optical axis in metres; 0, negative or not finite
    means no return, and such pixels neither get a variance nor make an edge.
    """
    expect(depth_m, "depth_m", np.float32, (None, None))
    valid = np.isfinite(depth_m) & (depth_m > 0)
    if params.formula is VarianceFormula.RELEASED:
        confidence = _released_confidence(depth_m, valid, intrinsics=intrinsics, params=params)
    else:
        confidence = _paper_confidence(depth_m, valid, params=params)
    usable = valid & (confidence >= np.float32(params.min_confidence))
    variance = np.full(depth_m.shape, np.inf, np.float32)
    np.divide(np.float32(1), confidence, out=variance, where=usable)
    return variance


def _released_confidence(
    depth_m: F32, valid: Bool, *, intrinsics: Intrinsics, params: VarianceParams
) -> F32:
    """s = (1 - tanh(k_g g)) exp(-((d_opt - D) / f)^2 / 3), (H, W) float32.

    g is the 11 x 11 maximum of |grad| of the 11 x 11 minimum of D, with the gradient in
    metres per image size over focal length, so that it does not depend on the resolution.
    """
    height, width = depth_m.shape
    window = np.ones((EDGE_WINDOW_PX, EDGE_WINDOW_PX), np.uint8)
    known: F32 = np.where(valid, depth_m, FARTHEST_M)
    nearest = np.empty(depth_m.shape, np.float32)
    cv2.erode(known, window, nearest, borderType=cv2.BORDER_CONSTANT, borderValue=float(FARTHEST_M))
    du, dv = _gradient(nearest, nearest < FARTHEST_M)
    scale_u, scale_v = intrinsics.size_over_focal(width, height)
    steepness = np.hypot(du * np.float32(scale_u), dv * np.float32(scale_v))
    worst = np.empty(depth_m.shape, np.float32)
    cv2.dilate(steepness, window, worst, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    leakage = 1 - np.tanh(worst * np.float32(params.gradient_factor))
    offset = _offset(depth_m, valid, params.optimal_distance_m) / np.float32(
        params.distance_factor_m
    )
    confidence: F32 = leakage * np.exp(-np.square(offset) / np.float32(3))
    return confidence


def _paper_confidence(depth_m: F32, valid: Bool, *, params: VarianceParams) -> F32:
    """1 / ((eps + tanh(D_u^2 + D_v^2)) exp(((d_opt - D) / 2)^2)), (H, W) float32.

    Eqs. gradvariance and featurevariance; derivatives in metres per pixel.
    """
    known: F32 = np.where(valid, depth_m, np.float32(0))
    du, dv = _gradient(known, valid)
    leakage = np.float32(params.epsilon) + np.tanh(np.square(du) + np.square(dv))
    offset = _offset(depth_m, valid, params.optimal_distance_m) / np.float32(2)
    confidence: F32 = np.exp(-np.square(offset)) / leakage
    return confidence


def _offset(depth_m: F32, valid: Bool, optimal_distance_m: float) -> F32:
    """Distance (H, W) from the optimum in metres, 0 where there is no depth."""
    offset: F32 = np.where(valid, np.float32(optimal_distance_m) - depth_m, np.float32(0))
    return offset


def _gradient(values: F32, valid: Bool) -> tuple[F32, F32]:
    """Central differences (H, W) along columns and rows, one-sided at the border.

    Zero where a value that enters is not valid, and along an axis of length one.
    """
    return _difference(values, valid, axis=1), _difference(values, valid, axis=0)


def _difference(values: F32, valid: Bool, *, axis: int) -> F32:
    if values.shape[axis] < 2:
        return np.zeros_like(values)
    slope: F32 = np.gradient(values, axis=axis)
    before_and_after = [(1, 1) if k == axis else (0, 0) for k in range(2)]
    padded = np.moveaxis(np.pad(valid, before_and_after, mode="edge"), axis, 0)
    known = np.moveaxis(padded[2:] & padded[:-2], 0, axis)
    return np.where(known, slope, np.float32(0))


def feature_field(
    frame: RgbdFrame, features: F16, encoder: Encoder, params: VarianceParams
) -> FeatureField:
    """The features (h, w, D) of a frame with colours, depth, pose and each pixel's variance.

    A dark frame has no colours: all that it shows would be black.
    """
    rows, columns = features.shape[:2]
    small = cv2.resize(frame.rgb, (columns, rows), interpolation=cv2.INTER_AREA).astype(np.uint8)
    lab = lab_of(small)
    return FeatureField(
        sequence=frame.sequence,
        stamp_ns=frame.stamp_ns,
        encoder_id=encoder.encoder_id,
        text_space=encoder.text_space,
        features=features,
        variance=observation_variance(frame.depth_mm * MILLIMETRE_M, frame.intrinsics, params),
        depth_mm=frame.depth_mm,
        intrinsics=frame.intrinsics,
        T_map_camera=frame.T_map_camera,
        world=frame.world,
        colours=packed(np.full_like(lab, np.nan) if is_dark(lab) else lab),
    )
