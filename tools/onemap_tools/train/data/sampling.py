"""Which frames are drawn how often: rare classes and those of hard pairs more."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from onemap_shared.geometry import F64, I64
from onemap_tools.train.data.frame_dataset import NAMELESS, FrameDataset
from onemap_tools.train.params import TrainParams

STRIDE_PX = 4  # every fourth row and column: a thing smaller than that teaches nothing
MIN_SHARE = 0.002  # of a frame's pixels, from which on it shows a class: three patches
BLOCK = 64  # frames read at once


def shown_classes(frames: FrameDataset) -> I64:
    """Pixels (N, K + 1) of every class, and of things without a name, at every fourth place."""
    classes = len(frames.classes)
    rows = [_counts(block, classes) for block in _blocks(frames)]
    return np.concatenate(rows)


def frame_probabilities(frames: FrameDataset, params: TrainParams) -> F64:
    """The probability (N,) with which each frame is drawn."""
    counts = shown_classes(frames)
    pixels = frames.label[0, ::STRIDE_PX, ::STRIDE_PX].size
    shows = counts > MIN_SHARE * pixels
    share = np.maximum(shows.mean(axis=0), 1 / len(frames))
    rarity = np.where(shows, share**-params.rare_power, 1.0).max(axis=1)
    hard = {name for pair in params.hard_pairs for name in pair}
    # A wall is in most frames: what makes a pair hard is the rarer of the two.
    columns = [i for i, name in enumerate(frames.classes) if name in hard and share[i] < 0.5]
    weights: F64 = rarity * (1 + params.hard_share * shows[:, columns].any(axis=1))
    probabilities: F64 = weights / weights.sum()
    return probabilities


def _blocks(frames: FrameDataset) -> Iterator[np.ndarray]:
    for start in range(0, len(frames), BLOCK):
        yield frames.label[start : start + BLOCK, ::STRIDE_PX, ::STRIDE_PX]


def _counts(labels: np.ndarray, classes: int) -> I64:
    """Pixels (B, K + 1) of labels (B, h, w); those of no class are left out."""
    flat = labels.reshape(len(labels), -1).astype(np.int64)
    place = np.where(flat == NAMELESS, classes, np.minimum(flat, classes + 1))
    place += np.arange(len(labels))[:, None] * (classes + 2)
    counts = np.bincount(place.ravel(), minlength=len(labels) * (classes + 2))
    result: I64 = counts.reshape(len(labels), classes + 2)[:, : classes + 1]
    return result
