"""Evaluation of the exported encoder: segmentation and retrieval; its temperature."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np

from onemap_perception.encoders.protocol import Encoder
from onemap_perception.text.embeddings import scores
from onemap_perception.text.vocabulary import Calibration, Vocabulary
from onemap_shared.geometry import F32, F64, I64, U8, Bool
from onemap_shared.messages import TextEmbeddings
from onemap_tools.train.batches import patch_targets
from onemap_tools.train.frames import FrameDataset

MIN_PATCHES = 2  # of a thing in an image; smaller ones are below the encoder's resolution
TEMPERATURES = np.geomspace(5, 80, 57)
# All but the temperature are chosen, not fitted: a word's query is expanded by its nearest classes
# with as much weight as itself, a soft choice among about three; words as near as 'a sofa' and
# 'a couch' count as synonyms.
DEFAULT_CALIBRATION = Calibration(
    temperature=20.0, expansion=1.0, sharpness=20.0, synonym=0.7, placed=0.45
)
PATCHES_PER_IMAGE = 60  # that the temperature is fitted on


@dataclass(frozen=True, slots=True)
class WordQueries:
    """Query words and the index of the class that each names."""

    texts: tuple[str, ...]
    classes: tuple[int, ...]
    queries: TextEmbeddings

    @classmethod
    def of(cls, pairs: Sequence[tuple[str, int]], encoder: Encoder) -> WordQueries:
        """Embed (word, class) pairs as queries, calibrated as the encoder is."""
        texts = tuple(text for text, _ in pairs)
        return cls(texts, tuple(index for _, index in pairs), encoder.embed_text(texts))


@dataclass(slots=True)
class _RetrievalMetrics:
    """By index of the word, its R-precision in each image that shows it."""

    words: WordQueries
    precision: defaultdict[int, list[float]] = field(default_factory=lambda: defaultdict(list))

    def add(self, score: F32, shares: F32) -> None:
        """Add an image: score (P, N) of words and shares (P, K) of classes, per patch."""
        for index, label in enumerate(self.words.classes):
            relevant: Bool = shares[:, label] > 0.5
            if relevant.sum() >= MIN_PATCHES:
                self.precision[index].append(r_precision(score[:, index], relevant))

    def mean(self) -> float:
        """Mean over words, so that frequent classes do not dominate."""
        return float(np.mean([np.mean(each) for each in self.precision.values()]))


def evaluate(
    encoder: Encoder, vocabulary: Vocabulary, frames: FrameDataset, progress: Callable[[int], None]
) -> dict[str, object]:
    """All figures over the frames; ``progress`` receives the number done."""
    names = WordQueries.of([(name, i) for i, name in enumerate(vocabulary.names)], encoder)
    synonyms = [(word, i) for i, entry in enumerate(vocabulary.classes) for word in entry.held_out]
    held_out = WordQueries.of(synonyms, encoder)
    classes = len(vocabulary.names)
    counts: I64 = np.zeros((classes, classes), np.int64)
    by_name, by_synonym = _RetrievalMetrics(names), _RetrievalMetrics(held_out)
    for number in range(len(frames)):
        rgb, label = frames[number]
        features = encoder.encode(rgb)
        rows, columns, dim = features.shape
        flat = features.reshape(-1, dim).astype(np.float32)
        shares = patch_targets(label[None], classes)
        by_name.add(scores(flat, names.queries), shares)
        by_synonym.add(scores(flat, held_out.queries), shares)
        cosines = (flat @ names.queries.embeddings.T).reshape(rows, columns, classes)
        counts += confusion(label, _pixel_classes(cosines, label.shape), classes)
        progress(number + 1)
    per_class = iou(counts)
    return {
        "frames": len(frames),
        "pixel_accuracy": float(np.trace(counts) / max(counts.sum(), 1)),
        "miou": float(np.nanmean(per_class)),
        "names_r_precision": by_name.mean(),
        "held_out_aliases_r_precision": by_synonym.mean(),
        "iou_by_class": {
            vocabulary.names[i]: round(float(per_class[i]), 3)
            for i in np.argsort(per_class)
            if np.isfinite(per_class[i])
        },
    }


def _pixel_classes(cosines: F32, shape: tuple[int, ...]) -> I64:
    """The best class (H, W) of every pixel; cosines (h, w, K) are interpolated between patches."""
    large = cv2.resize(cosines, (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR)
    best: I64 = large.argmax(axis=2)
    return best


def fit_temperature(
    encoder: Encoder, names: TextEmbeddings, frames: FrameDataset, rng: np.random.Generator
) -> float:
    """The temperature under which the true classes' shares are likeliest.

    ``names`` are the class names in the order of the labels; each patch is a draw from the
    softmax over all of them and the neutral words.
    """
    classes = len(names.texts)
    cosines: list[F32] = []
    shares: list[F32] = []
    for rgb, label in (frames[number] for number in range(len(frames))):
        features = encoder.encode(rgb).astype(np.float32)
        target = patch_targets(label[None], classes)
        chosen = rng.choice(len(target), PATCHES_PER_IMAGE, replace=False)
        rows = features.reshape(len(target), -1)[chosen]
        unrelated = names.neutral[classes:]
        cosines.append(rows @ np.concatenate([names.embeddings, unrelated]).T)
        shares.append(target[chosen])
    return most_likely_temperature(np.concatenate(cosines), np.concatenate(shares))


def most_likely_temperature(cosines: F32, shares: F32) -> float:
    """cosines (P, K + M), shares (P, K) of the first K; the last M are never right."""
    losses: list[float] = []
    for temperature in TEMPERATURES:
        logits: F64 = cosines.astype(np.float64) * temperature
        logits -= logits.max(axis=1, keepdims=True)
        log_share = logits - np.log(np.exp(logits).sum(axis=1, keepdims=True))
        losses.append(-float((shares * log_share[:, : shares.shape[1]]).sum(axis=1).mean()))
    return float(TEMPERATURES[int(np.argmin(losses))])


def confusion(label: U8, predicted: I64, classes: int) -> I64:
    """Counts (K, K), true class by predicted class, over the pixels of a known class."""
    known = label < classes
    index = label[known].astype(np.int64) * classes + predicted[known]
    return np.bincount(index, minlength=classes * classes).reshape(classes, classes)


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


EVALUATION_SETS = {
    "held_out": "apartments never trained on, same style",
    "other_style": "the simulator's held-out style: other textures, proportions, light",
}
FIGURE_ROWS = {
    "pixel_accuracy": "pixel accuracy",
    "miou": "mIoU",
    "names_r_precision": "R-precision, class names",
    "held_out_aliases_r_precision": "R-precision, held-out synonyms",
    "frames": "images",
}


def figures_table(figures: dict[str, Any]) -> str:
    """The figures of each set of frames, as a Markdown table."""
    lines = [
        "| | " + " | ".join(EVALUATION_SETS.values()) + " |",
        "|---|" + "---|" * len(EVALUATION_SETS),
    ]
    for key, title in FIGURE_ROWS.items():
        cells = [figures[name][key] for name in EVALUATION_SETS]
        shown = [f"{cell:.3f}" if isinstance(cell, float) else str(cell) for cell in cells]
        lines.append(f"| {title} | " + " | ".join(shown) + " |")
    return "\n".join(lines)
