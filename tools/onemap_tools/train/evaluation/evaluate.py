"""Evaluation of the exported encoder: segmentation, retrieval, detection, calibration."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain

import cv2
import numpy as np

from onemap_perception.detectors.protocol import Image
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.text.scores import scores
from onemap_perception.text.vocabulary import Vocabulary
from onemap_shared.geometry import F16, F32, F64, I64, U8, Bool
from onemap_shared.messages import TextEmbeddings
from onemap_tools.train.data.frame_dataset import FrameDataset
from onemap_tools.train.evaluation import metrics
from onemap_tools.train.evaluation.detector_metrics import DetectorMetrics
from onemap_tools.train.network.losses import patch_targets

MIN_PATCHES = 2  # of a thing in an image; smaller ones are below the encoder's resolution
SAMPLED = 21  # of so many patches one: no divisor of the columns, so that all parts of images occur
TOP_PATCHES = 2  # an image's score for a word is the mean of its best patches


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
                self.precision[index].append(metrics.r_precision(score[:, index], relevant))
                self.present[index].append(float(best[index]))
            elif shares[:, label].max() == 0:
                self.absent[index].append(float(best[index]))

    def summary(self, texts: Sequence[str]) -> dict[str, object]:
        """Means over words, so that frequent classes do not dominate."""
        seen = [index for index in range(self.count) if self.precision[index]]
        by_word = {texts[i]: round(float(np.mean(self.precision[i])), 3) for i in seen}
        per_word = [
            metrics.auroc(*_scores_and_labels(self.present[i], self.absent[i]))
            for i in seen
            if self.absent[i]
        ]
        pooled = _scores_and_labels(list(chain(*self.present)), list(chain(*self.absent)))
        return {
            "words": len(seen),
            "r_precision": float(np.mean(list(by_word.values()))),
            "auroc_mean_over_words": float(np.mean(per_word)),
            "auroc_pooled": metrics.auroc(*pooled),
            "r_precision_by_word": dict(sorted(by_word.items(), key=lambda item: item[1])),
        }


def evaluate(
    encoder: Encoder, vocabulary: Vocabulary, frames: FrameDataset, progress: Callable[[int], None]
) -> dict[str, object]:
    """All figures over the frames; ``progress`` receives the number done.

    Those of perfect patches say what patches of 8 x 8 pixels allow: every patch knows the true
    shares of its classes.
    """
    names = WordQueries.of([(name, i) for i, name in enumerate(vocabulary.names)], encoder)
    held_out = WordQueries.of(held_out_queries(vocabulary), encoder)
    classes = len(vocabulary.names)
    counts: I64 = np.zeros((classes, classes), np.int64)
    perfect: I64 = np.zeros((classes, classes), np.int64)
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
        counts += metrics.confusion(label, _pixel_classes(cosines, label.shape), classes)
        exact = _pixel_classes(shares.reshape(rows, columns, classes), label.shape)
        perfect += metrics.confusion(label, exact, classes)
        progress(number + 1)
    bins = metrics.reliability(_concatenate(stated), _concatenate(observed))
    return {
        "frames": len(frames),
        **_segmentation(vocabulary.names, counts, perfect),
        "names": retrieval["names"].summary(names.texts),
        "held_out_aliases": retrieval["held_out"].summary(held_out.texts),
        "detector": detector.summary(),
        "reliability": bins,
        "calibration_error": metrics.calibration_error(bins),
        "class_names": list(vocabulary.names),
        "confusion": counts.tolist(),
    }


def _segmentation(names: Sequence[str], counts: I64, perfect: I64) -> dict[str, object]:
    """Figures of confusions (K, K) in pixels: of the encoder, and of perfect patches."""
    per_class, limit = metrics.iou(counts), metrics.iou(perfect)
    return {
        "pixel_accuracy": metrics.accuracy(counts),
        "miou": float(np.nanmean(per_class)),
        "classes": int(np.isfinite(per_class).sum()),
        "iou_by_class": _ascending(names, per_class),
        "miou_of_perfect_patches": float(np.nanmean(limit)),
        "iou_of_perfect_patches": _ascending(names, limit),
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
