"""Evaluation of the exported encoder: segmentation, retrieval, detection, calibration.

scikit-learn has the confusion matrix and the AUROC too; it would add 60 MB for ten lines, and
its confusion matrix of an image takes 30 times as long.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain

import cv2
import numpy as np
from scipy.stats import rankdata

from onemap_perception.detectors.patches import PatchDetector, PatchLimits
from onemap_perception.detectors.protocol import Image
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.text.embeddings import scores
from onemap_perception.text.vocabulary import Calibration, Vocabulary
from onemap_shared.geometry import F16, F32, F64, I64, U8, Bool
from onemap_shared.messages import TextEmbeddings
from onemap_tools.train.frames import FrameDataset
from onemap_tools.train.losses import patch_targets

MIN_PATCHES = 2  # of a thing in an image; smaller ones are below the encoder's resolution
SAMPLED = 21  # of so many patches one: no divisor of the columns, so that all parts of images occur
TOP_PATCHES = 2  # an image's score for a word is the mean of its best patches
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
    """Per word: R-precision in images that show it, and scores of images with and without it."""

    count: int
    precision: list[list[float]] = field(init=False)
    present: list[list[float]] = field(init=False)
    absent: list[list[float]] = field(init=False)

    def __post_init__(self) -> None:
        self.precision = [[] for _ in range(self.count)]
        self.present = [[] for _ in range(self.count)]
        self.absent = [[] for _ in range(self.count)]

    def add(self, score: F32, shares: F32, words: WordQueries) -> None:
        """Add an image: score (P, N) of words and shares (P, K) of classes, per patch."""
        best = np.sort(score, axis=0)[-TOP_PATCHES:].mean(axis=0)
        for index, label in enumerate(words.classes):
            relevant: Bool = shares[:, label] > 0.5
            if relevant.sum() >= MIN_PATCHES:
                self.precision[index].append(r_precision(score[:, index], relevant))
                self.present[index].append(float(best[index]))
            elif shares[:, label].max() == 0:
                self.absent[index].append(float(best[index]))

    def summary(self, texts: Sequence[str]) -> dict[str, object]:
        """Means over words, so that frequent classes do not dominate."""
        seen = [index for index in range(self.count) if self.precision[index]]
        by_word = {texts[i]: round(float(np.mean(self.precision[i])), 3) for i in seen}
        per_word = [
            auroc(*_scores_and_labels(self.present[i], self.absent[i]))
            for i in seen
            if self.absent[i]
        ]
        pooled = _scores_and_labels(list(chain(*self.present)), list(chain(*self.absent)))
        return {
            "words": len(seen),
            "r_precision": float(np.mean(list(by_word.values()))),
            "auroc_mean_over_words": float(np.mean(per_word)),
            "auroc_pooled": auroc(*pooled),
            "r_precision_by_word": dict(sorted(by_word.items(), key=lambda item: item[1])),
        }


def evaluate(
    encoder: Encoder, vocabulary: Vocabulary, frames: FrameDataset, progress: Callable[[int], None]
) -> dict[str, object]:
    """All figures over the frames; ``progress`` receives the number done."""
    names = WordQueries.of([(name, i) for i, name in enumerate(vocabulary.names)], encoder)
    held_out = WordQueries.of(held_out_queries(vocabulary), encoder)
    classes = len(vocabulary.names)
    counts: I64 = np.zeros((classes, classes), np.int64)
    retrieval = {
        "names": _RetrievalMetrics(len(names.texts)),
        "held_out": _RetrievalMetrics(len(held_out.texts)),
    }
    detector = DetectorMetrics(vocabulary.names)
    stated: list[F32] = []
    observed: list[F32] = []
    for number, (rgb, features, label) in enumerate(_encode_frames(encoder, frames)):
        rows, columns, dim = features.shape
        flat = features.reshape(-1, dim).astype(np.float32)
        shares = patch_targets(_fit_to_patches(label, rows, columns)[None], classes)
        detector.add(Image(rgb, features), names.queries, shares)
        name_scores = scores(flat, names.queries)
        retrieval["names"].add(name_scores, shares, names)
        retrieval["held_out"].add(scores(flat, held_out.queries), shares, held_out)
        stated.append(name_scores[::SAMPLED].ravel())
        observed.append(shares[::SAMPLED].ravel())
        cosines = (flat @ names.queries.embeddings.T).reshape(rows, columns, classes)
        counts += confusion(label, _pixel_classes(cosines, label.shape), classes)
        progress(number + 1)
    bins = reliability(_concatenate(stated), _concatenate(observed))
    per_class = iou(counts)
    return {
        "frames": len(frames),
        "pixel_accuracy": accuracy(counts),
        "miou": float(np.nanmean(per_class)),
        "classes": int(np.isfinite(per_class).sum()),
        "names": retrieval["names"].summary(names.texts),
        "held_out_aliases": retrieval["held_out"].summary(held_out.texts),
        "detector": detector.summary(),
        "reliability": bins,
        "calibration_error": calibration_error(bins),
        "iou_by_class": _ascending(vocabulary.names, per_class),
        "class_names": list(vocabulary.names),
        "confusion": counts.tolist(),
    }


def _ascending(names: Sequence[str], values: F64) -> dict[str, float]:
    """Finite values (K,) by name, lowest first; sorting with NaN among them would not order."""
    finite = [
        (name, round(float(value), 3))
        for name, value in zip(names, values, strict=True)
        if np.isfinite(value)
    ]
    return dict(sorted(finite, key=lambda item: item[1]))


def held_out_queries(vocabulary: Vocabulary) -> list[tuple[str, int]]:
    """Synonyms that were never training targets, with the index of their class."""
    return [(word, i) for i, entry in enumerate(vocabulary.classes) for word in entry.held_out]


def _encode_frames(encoder: Encoder, frames: FrameDataset) -> Iterator[tuple[U8, F16, U8]]:
    for rgb, label in zip(frames.rgb, frames.label, strict=True):
        image = np.asarray(rgb)
        yield image, encoder.encode(image), np.asarray(label)


def _fit_to_patches(label: U8, rows: int, columns: int) -> U8:
    """The label image at 8 pixels per patch."""
    size = (columns * 8, rows * 8)
    if label.shape == (size[1], size[0]):
        return label
    return cv2.resize(label, size, interpolation=cv2.INTER_NEAREST).astype(np.uint8)


def _pixel_classes(cosines: F32, shape: tuple[int, ...]) -> I64:
    """The best class (H, W) of every pixel; cosines (h, w, K) are interpolated between patches."""
    large = cv2.resize(cosines, (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR)
    best: I64 = large.argmax(axis=2)
    return best


def _scores_and_labels(present: Sequence[float], absent: Sequence[float]) -> tuple[F64, Bool]:
    values = np.array([*present, *absent], np.float64)
    return values, np.arange(len(values)) < len(present)


def _concatenate(parts: Sequence[F32]) -> F64:
    return np.concatenate(parts).astype(np.float64)


@dataclass(slots=True)
class DetectorMetrics:
    """Counts over images, in each of which every name is searched with the default thresholds.

    A detection is correct if its class fills most of its mask. A class is present if it fills as
    many patches as the detector requires.
    """

    names: tuple[str, ...]
    params: PatchLimits = field(default_factory=PatchLimits)
    correct: int = 0
    wrong: int = 0
    instances: int = 0
    found: int = 0
    images: int = 0

    def add(self, image: Image, queries: TextEmbeddings, shares: F32) -> None:
        """Add an image: shares (P, K) of every class in its patches; queries are ``names``."""
        assert image.features is not None
        maps = shares.reshape(*image.features.shape[:2], -1)
        present: Bool = (maps > 0.5).sum(axis=(0, 1)) >= self.params.min_patches
        hit = np.zeros_like(present)
        for detection in PatchDetector("", self.params).detect(image, queries):
            index = self.names.index(detection.name)
            if maps[..., index][detection.mask].mean() > 0.5:
                self.correct += 1
                hit[index] = True
            else:
                self.wrong += 1
        self.images += 1
        self.instances += int(present.sum())
        self.found += int((present & hit).sum())

    def summary(self) -> dict[str, float]:
        """Precision, recall and wrong detections per image, over all names."""
        return {
            "precision": self.correct / max(self.correct + self.wrong, 1),
            "recall": self.found / max(self.instances, 1),
            "wrong_per_picture": self.wrong / max(self.images, 1),
        }


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
    for rgb, label in zip(frames.rgb, frames.label, strict=True):
        features = encoder.encode(np.asarray(rgb)).astype(np.float32)
        target = patch_targets(np.asarray(label)[None], classes)
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
