"""How far an encoder may be believed: the score of its best answer, and things without a class.

The calibration over all patches and words is nearly zero for any encoder that says 0 to most
words, which is right for most; that of the best answer is the one that a robot acts on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np

from onemap_perception.encoders.protocol import Encoder
from onemap_perception.text.scores import scores
from onemap_shared.geometry import F32, I64, U8, Bool
from onemap_shared.messages import TextEmbeddings
from onemap_tools.train.evaluation import metrics

SURE = 0.5  # a score from which on an answer counts as given with confidence
PURE = 0.9  # share of a patch that one class must fill to count


@dataclass(slots=True)
class BestAnswers:
    """Collects the best word of every pure patch. ``names``: what is asked for.

    A label below len(names) is one of them; up to that plus len(strangers) a thing outside.
    """

    names: tuple[str, ...]
    strangers: tuple[str, ...] = ()
    stated: list[F32] = field(default_factory=list)
    chosen: list[I64] = field(default_factory=list)
    labels: list[I64] = field(default_factory=list)

    def add(self, score: F32, label: U8) -> None:
        """Add an image: score (P, K) of the names per patch; label (H, W), 8 pixels a patch."""
        patch_labels, pure = _patch_labels(label, len(self.names) + len(self.strangers))
        best = score.argmax(axis=1)
        self.chosen.append(best[pure].astype(np.int64))
        self.stated.append(score[np.arange(len(score)), best][pure])
        self.labels.append(patch_labels[pure])

    def summary(self) -> dict[str, Any]:
        """Calibration error of the best answer; wrong ones among the sure; each stranger."""
        stated, chosen = np.concatenate(self.stated).astype(np.float64), np.concatenate(self.chosen)
        labels = np.concatenate(self.labels)
        right = chosen == labels
        sure = stated >= SURE
        bins = metrics.reliability(stated, right.astype(np.float64))
        return {
            "patches": len(labels),
            "calibration_error": metrics.calibration_error(bins),
            "reliability": bins,
            "right": float(right.mean()),
            "sure": float(sure.mean()),
            "wrong_of_sure": float((~right & sure).sum() / max(sure.sum(), 1)),
            "strangers": {
                name: self._stranger(labels == len(self.names) + index, stated, chosen)
                for index, name in enumerate(self.strangers)
            },
        }

    def _stranger(self, there: Bool, stated: np.ndarray, chosen: I64) -> dict[str, Any]:
        """What the patches of a thing outside the names are taken for."""
        if not there.any():
            return {"patches": 0}
        counts = np.bincount(chosen[there], minlength=len(self.names))
        return {
            "patches": int(there.sum()),
            "sure": float((stated[there] >= SURE).mean()),
            "taken_for": self.names[int(counts.argmax())],
            "share": float(counts.max() / counts.sum()),
        }


def best_answers(
    encoder: Encoder,
    names: Sequence[str],
    frames: Sequence[tuple[U8, U8]],
    progress: Callable[[int], None],
    strangers: Sequence[str] = (),
) -> dict[str, Any]:
    """The summary over (rgb, label) images; labels as in BestAnswers."""
    queries: TextEmbeddings = encoder.embed_text(tuple(names))
    collected = BestAnswers(tuple(names), tuple(strangers))
    for number, (rgb, label) in enumerate(frames):
        features = encoder.encode(np.asarray(rgb))
        rows, columns, dim = features.shape
        score = scores(features.reshape(-1, dim).astype(np.float32), queries)
        size = (columns * 8, rows * 8)
        fitted = cv2.resize(np.asarray(label), size, interpolation=cv2.INTER_NEAREST)
        collected.add(score, fitted.astype(np.uint8))
        progress(number + 1)
    return collected.summary()


def _patch_labels(label: U8, classes: int, stride: int = 8) -> tuple[I64, Bool]:
    """The most frequent label (P,) of every patch and whether it fills the patch."""
    rows, columns = label.shape[0] // stride, label.shape[1] // stride
    patches = label.reshape(rows, stride, columns, stride).transpose(0, 2, 1, 3)
    flat = np.minimum(patches.reshape(-1, stride * stride), classes).astype(np.int64)
    index = flat + np.arange(len(flat))[:, None] * (classes + 1)
    counts = np.bincount(index.ravel(), minlength=len(flat) * (classes + 1))
    table = counts.reshape(len(flat), classes + 1)[:, :classes]
    best: I64 = table.argmax(axis=1)
    return best, table.max(axis=1) >= PURE * stride * stride
