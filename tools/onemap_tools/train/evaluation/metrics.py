"""Figures of merit, from plain arrays.

scikit-learn has the confusion matrix and the AUROC too; it would add 60 MB for ten lines, and
its confusion matrix of an image takes 30 times as long.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import rankdata

from onemap_shared.geometry import F32, F64, I64, U8, Bool


def confusion(label: U8, predicted: I64, classes: int) -> I64:
    """Counts (K, K), true class by predicted class, over the pixels of a known class."""
    known = label < classes
    index = label[known].astype(np.int64) * classes + predicted[known]
    return np.bincount(index, minlength=classes * classes).reshape(classes, classes)


def accuracy(counts: I64) -> float:
    """Share of correct pixels."""
    return float(np.trace(counts) / max(counts.sum(), 1))


def iou(counts: I64) -> F64:
    """Intersection over union of each class (K,); NaN for a class that does not occur."""
    hit = np.diag(counts).astype(np.float64)
    union = counts.sum(axis=0) + counts.sum(axis=1) - hit
    result = np.full(len(hit), np.nan)
    occurs = counts.sum(axis=1) > 0
    result[occurs] = hit[occurs] / union[occurs]
    return result


def r_precision(scores: F32, relevant: Bool) -> float:
    """Share of relevant items among the R best by score, R = their number; NaN if R = 0."""
    count = int(relevant.sum())
    if count == 0:
        return float("nan")
    best = np.argpartition(-scores.ravel(), count - 1)[:count]
    return float(relevant.ravel()[best].mean())


def auroc(scores: F64, positive: Bool) -> float:
    """Probability that a positive scores above a negative, ties counting half (Mann-Whitney).

    NaN unless there are both.
    """
    ranks = rankdata(scores)
    positives = int(positive.sum())
    negatives = len(positive) - positives
    if positives == 0 or negatives == 0:
        return float("nan")
    above = ranks[positive].sum() - positives * (positives + 1) / 2
    return float(above / (positives * negatives))


def reliability(probability: F64, right: F64, bins: int = 10) -> list[dict[str, float]]:
    """Per bin of stated probability: its mean, the observed frequency, and the count."""
    place = np.minimum((probability * bins).astype(int), bins - 1)
    rows = []
    for index in range(bins):
        inside = place == index
        if inside.any():
            stated, true = float(probability[inside].mean()), float(right[inside].mean())
            rows.append({"stated": stated, "right": true, "count": float(inside.sum())})
    return rows


def calibration_error(rows: list[dict[str, float]]) -> float:
    """Expected calibration error: mean of |stated - observed|, weighted by count."""
    total = sum(row["count"] for row in rows)
    return sum(abs(row["stated"] - row["right"]) * row["count"] for row in rows) / max(total, 1)
