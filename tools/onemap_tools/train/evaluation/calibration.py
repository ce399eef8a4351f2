"""Fit of the softmax temperature under which scores are calibrated probabilities."""

from __future__ import annotations

import numpy as np

from onemap_perception.encoders.protocol import Encoder
from onemap_perception.text.calibration import Calibration
from onemap_shared.geometry import F32, F64
from onemap_shared.messages import TextEmbeddings
from onemap_tools.train.data.batches import named_targets
from onemap_tools.train.data.frame_dataset import FrameDataset

TEMPERATURES = np.geomspace(5, 80, 57)
# All but the temperature are chosen, not fitted: a word's query is expanded by its nearest classes
# with as much weight as itself, a soft choice among about three; words as near as 'a sofa' and
# 'a couch' count as synonyms.
DEFAULT_CALIBRATION = Calibration(
    temperature=20.0, expansion=1.0, sharpness=20.0, synonym=0.7, placed=0.45
)
PATCHES_PER_IMAGE = 60  # per image
TINY = 1e-300  # a share of nothing still has a logarithm


def fit_temperature(
    encoder: Encoder, names: TextEmbeddings, frames: FrameDataset, rng: np.random.Generator
) -> float:
    """The temperature under which the true classes' shares are likeliest.

    ``names`` are the class names in the order of the labels; each patch is a draw from the
    softmax over all of them and the neutral words, which are right for things without a name.
    """
    classes = len(names.texts)
    cosines: list[F32] = []
    shares: list[F32] = []
    for rgb, label in zip(frames.rgb, frames.label, strict=True):
        features = encoder.encode(np.asarray(rgb)).astype(np.float32)
        target = named_targets(np.asarray(label)[None], classes)
        chosen = rng.choice(len(target), PATCHES_PER_IMAGE, replace=False)
        rows = features.reshape(len(target), -1)[chosen]
        unrelated = names.neutral[classes:]
        cosines.append(rows @ np.concatenate([names.embeddings, unrelated]).T)
        shares.append(target[chosen])
    return most_likely_temperature(np.concatenate(cosines), np.concatenate(shares))


def most_likely_temperature(cosines: F32, shares: F32) -> float:
    """cosines (P, K + M) to classes and neutral words; shares (P, K + 1), the last: no name."""
    classes = shares.shape[1] - 1
    losses: list[float] = []
    for temperature in TEMPERATURES:
        logits: F64 = cosines.astype(np.float64) * temperature
        logits -= logits.max(axis=1, keepdims=True)
        weights = np.exp(logits)
        likely = logits[:, :classes] - np.log(weights.sum(axis=1, keepdims=True))
        none = np.log(np.maximum(weights[:, classes:].sum(axis=1), TINY) / weights.sum(axis=1))
        right = (shares[:, :classes] * likely).sum(axis=1) + shares[:, classes] * none
        losses.append(-float(right.mean()))
    return float(TEMPERATURES[int(np.argmin(losses))])
