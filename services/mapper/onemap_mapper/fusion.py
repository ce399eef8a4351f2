"""Bayesian fusion of a cell's features, Eqs. bayes1-3 in inverse-variance form.

Confidence is c = 1 / sigma^2. The printed equations weight features by their variance, the
released code and this module by its inverse: certain observations count more. The result is the
confidence-weighted mean of all observations, in whatever order they come.
"""

from __future__ import annotations

import torch
from torch import Tensor

TINY = 1e-38  # below any confidence: the gain of an unobserved cell is 0 / TINY, not NaN


def gain(confidence: Tensor, confidence_new: Tensor) -> Tensor:
    """K = c_new / (c + c_new), (n,) float32 in [0, 1], of confidences (n,); 0 where both are 0.

    Eq. bayes1 in inverse-variance form; c + c_new is Eq. bayes3.
    """
    total = confidence + confidence_new
    return confidence_new / total.clamp(min=TINY)


def fused(features: Tensor, features_new: Tensor, K: Tensor) -> Tensor:
    """F + K (F_new - F) for features (n, D) float32 and gains (n,) (Eq. bayes2)."""
    return torch.lerp(features, features_new, K[:, None])


def with_process_noise(confidence: Tensor, *, rate_per_s: float, elapsed_s: float) -> Tensor:
    """Confidence (n,) after its variance grew by ``rate_per_s`` for ``elapsed_s`` seconds.

    c / (1 + q t c): the process noise q t, added to the variance 1 / c.
    """
    return confidence / (1.0 + rate_per_s * elapsed_s * confidence)
