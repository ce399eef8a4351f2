"""Training targets and loss, per 8 x 8 patch."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from onemap_shared.geometry import F32, U8

TEMPERATURE = 20.0  # of the softmax: a cosine larger by 0.1 is e^2 times as probable
COSINE_WEIGHT = 0.5  # beside the cross-entropy, which alone leaves the absolute cosine free


def patch_targets(label: U8, classes: int, stride: int = 8) -> F32:
    """Share of every class in each patch, row by row: (B * H/stride * W/stride, K) float32.

    label (B, H, W) uint8; pixels of no class (>= K) count for none, so that the shares of a
    patch sum to how much of it is known.
    """
    batch, height, width = label.shape
    rows, columns = height // stride, width // stride
    patches = label.reshape(batch, rows, stride, columns, stride).transpose(0, 1, 3, 2, 4)
    flat = np.minimum(patches.reshape(-1, stride * stride), classes).astype(np.int64)
    index = flat + np.arange(len(flat))[:, None] * (classes + 1)
    counts = np.bincount(index.ravel(), minlength=len(flat) * (classes + 1))
    shares = counts.reshape(len(flat), classes + 1)[:, :classes]
    result: F32 = (shares / (stride * stride)).astype(np.float32)
    return result


def class_weights(frequency: F32, power: float) -> Tensor:
    """Weights (K,) as frequency to minus ``power``, of mean 1 over what is seen; frequency (K,)."""
    share = np.maximum(frequency / max(float(frequency.sum()), 1e-12), 1e-4)
    weights = share**-power
    weights /= float((weights * share).sum() / share.sum())
    return torch.from_numpy(weights.astype(np.float32))


def alignment_loss(features: Tensor, targets: Tensor, texts: Tensor, weights: Tensor) -> Tensor:
    """Mean over patches of the class-weighted cross-entropy plus the cosine to the target text.

    features (P, D) of any length; targets (P, K) shares of the classes; texts (K + M, D) unit
    rows, those after the K classes never right; weights (K,) of the classes.
    """
    # Dividing P x T cosines by the length is cheaper than making P x D features unit.
    cosine = features @ texts.T / features.norm(dim=1, keepdim=True).clamp_min(1e-6)
    classes = targets.shape[1]
    log_share = functional.log_softmax(TEMPERATURE * cosine, dim=1)[:, :classes]
    per_class = -log_share + COSINE_WEIGHT * (1 - cosine[:, :classes])
    weighted = targets * weights
    loss: Tensor = (weighted * per_class).sum() / weighted.sum().clamp_min(1e-6)
    return loss
