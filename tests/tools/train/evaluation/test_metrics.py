"""Figures of merit against slow twins and on cases known by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_tools.train.evaluation import metrics


def test_confusion_accuracy_and_iou() -> None:
    label = np.array([[0, 0, 1], [1, 1, 255]], np.uint8)
    predicted = np.array([[0, 1, 1], [1, 1, 0]])
    counts = metrics.confusion(label, predicted, 3)
    assert counts.tolist() == [[1, 1, 0], [0, 3, 0], [0, 0, 0]]
    assert metrics.accuracy(counts) == pytest.approx(0.8)
    np.testing.assert_allclose(metrics.iou(counts), [0.5, 0.75, np.nan])


def test_r_precision_counts_the_best() -> None:
    scores = np.array([0.9, 0.1, 0.8, 0.7], np.float32)
    assert metrics.r_precision(scores, np.array([True, False, False, True])) == 0.5
    assert np.isnan(metrics.r_precision(scores, np.zeros(4, bool)))


@given(
    positive=st.lists(st.integers(0, 5), min_size=1, max_size=8),
    negative=st.lists(st.integers(0, 5), min_size=1, max_size=8),
)
def test_auroc_is_the_chance_that_a_positive_scores_above(
    positive: list[int], negative: list[int]
) -> None:
    scores = np.array([*positive, *negative], np.float64)
    slow = np.mean([1.0 if p > n else 0.5 if p == n else 0.0 for p in positive for n in negative])
    fast = metrics.auroc(scores, np.arange(len(scores)) < len(positive))
    assert fast == pytest.approx(float(slow))


@pytest.mark.parametrize("positive", [True, False])
def test_auroc_of_one_class_alone_is_undefined(positive: bool) -> None:
    assert np.isnan(metrics.auroc(np.array([0.1, 0.2]), np.full(2, positive)))


def test_reliability_of_honest_and_boastful_probabilities() -> None:
    probability = np.array([0.05, 0.15, 0.95, 0.95])
    honest = metrics.reliability(probability, probability)
    assert metrics.calibration_error(honest) == pytest.approx(0)
    boastful = metrics.reliability(probability, np.zeros(4))
    assert metrics.calibration_error(boastful) == pytest.approx(float(probability.mean()))
    assert [row["count"] for row in honest] == [1, 1, 2]
