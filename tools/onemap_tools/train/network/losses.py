"""Training targets and loss, per 8 x 8 patch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from onemap_shared.geometry import F32, U8
from onemap_tools.train.params import LossParams


@dataclass(frozen=True, slots=True)
class ClassWeighting:
    """weights (K + 1,) of the classes and of things without a name; confusable (K, K) 0 or 1."""

    weights: Tensor
    confusable: Tensor


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


def confusable_classes(names: Sequence[str], pairs: Sequence[tuple[str, str]]) -> Tensor:
    """1 where two classes form a pair, (K, K) float32, symmetric; names that are missing: none."""
    index = {name: place for place, name in enumerate(names)}
    table = torch.zeros(len(names), len(names))
    for one, other in pairs:
        if one in index and other in index:
            table[index[one], index[other]] = table[index[other], index[one]] = 1
    return table


def alignment_loss(
    features: Tensor, targets: Tensor, texts: Tensor, weighting: ClassWeighting, params: LossParams
) -> Tensor:
    """Mean over patches of the class-weighted cross-entropy plus the cosine to the target text.

    features (P, D) of any length; targets (P, K + 1) shares of the classes and of things without
    a name; texts (K + M, D) unit rows. A thing without a name is right where the M neutral words
    have the softmax: their sum is the share of "none of these". The classes that the true one is
    often taken for get ``params.margin`` more, so that it has to win by that much (as Wang et
    al., "CosFace" (2018), for all classes).
    """
    classes = targets.shape[1] - 1
    # Dividing P x T cosines by the length is cheaper than making P x D features unit.
    cosine = features @ texts.T / features.norm(dim=1, keepdim=True).clamp_min(1e-6)
    logits = params.temperature * cosine
    rivals = params.margin * (targets[:, :classes] @ weighting.confusable)
    logits = torch.cat([logits[:, :classes] + rivals, logits[:, classes:]], dim=1)
    log_share = functional.log_softmax(logits, dim=1)
    named = -log_share[:, :classes] + params.cosine_weight * (1 - cosine[:, :classes])
    nameless = -log_share[:, classes:].logsumexp(dim=1, keepdim=True)
    per_class = torch.cat([named, nameless], dim=1)
    weighted = targets * weighting.weights
    loss: Tensor = (weighted * per_class).sum() / weighted.sum().clamp_min(1e-6)
    return loss
