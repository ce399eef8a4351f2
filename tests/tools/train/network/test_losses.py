"""Targets, class weights and the loss of patches."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from onemap_tools.train.data.frame_dataset import NO_CLASS
from onemap_tools.train.network.losses import (
    ClassWeighting,
    alignment_loss,
    class_weights,
    confusable_classes,
    patch_targets,
)
from onemap_tools.train.params import LossParams


def test_patch_targets_are_shares_of_pixels() -> None:
    label = np.zeros((1, 8, 16), np.uint8)
    label[0, :2, :8] = 1
    label[0, :, 12:] = NO_CLASS
    np.testing.assert_allclose(patch_targets(label, 2), [[0.75, 0.25], [0.5, 0.0]])


def test_rare_classes_weigh_more_and_the_mean_is_one() -> None:
    frequency = np.array([0.9, 0.1, 0.0], np.float32)
    weights = class_weights(frequency, 0.5).numpy()
    assert weights[1] / weights[0] == pytest.approx(3)
    assert weights[2] > weights[1]
    assert weights @ frequency == pytest.approx(1, rel=0.02)
    np.testing.assert_allclose(class_weights(frequency, 0.0).numpy(), 1, rtol=1e-6)


EVEN = ClassWeighting(torch.ones(3), torch.zeros(2, 2))


def test_the_loss_is_least_at_the_right_text() -> None:
    texts = torch.eye(3, 384)
    targets = torch.tensor([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])

    def loss(features: torch.Tensor) -> float:
        return alignment_loss(features, targets, texts, EVEN, LossParams()).item()

    right, wrong, neutral = texts[[0, 1, 2]], texts[[1, 0, 2]], texts[[2, 2, 2]]
    assert loss(right) == pytest.approx(0, abs=1e-6)
    assert loss(wrong) == pytest.approx(20.5, abs=1e-4)  # 20 nats and a cosine of 0
    assert loss(neutral) == pytest.approx(20.5, abs=1e-4)
    assert loss(5 * right) == pytest.approx(loss(right), abs=1e-6)


def test_the_loss_is_a_mean_weighted_by_class() -> None:
    texts = torch.eye(3, 384)
    targets = torch.tensor([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    features = texts[[0, 0]]  # the second class is missed
    for weight, expected in ((1.0, 20.5 / 2), (3.0, 20.5 * 3 / 4)):
        weighting = ClassWeighting(torch.tensor([1.0, weight, 1.0]), torch.zeros(2, 2))
        loss = alignment_loss(features, targets, texts, weighting, LossParams()).item()
        assert loss == pytest.approx(expected, abs=1e-4)


def test_a_thing_without_a_name_is_right_at_any_neutral_word() -> None:
    texts = torch.eye(4, 384)  # two classes and two neutral words
    targets = torch.tensor([[0.0, 0.0, 1.0]])
    losses = [
        alignment_loss(texts[[row]], targets, texts, EVEN, LossParams()).item() for row in range(4)
    ]
    assert losses[2:] == pytest.approx([0, 0], abs=1e-6)
    assert min(losses[:2]) > 15


def test_the_right_class_has_to_win_by_a_margin_over_one_it_is_taken_for() -> None:
    texts = torch.eye(3, 384)
    undecided = texts[[0]] + texts[[1]]
    targets = torch.tensor([[1.0, 0.0, 0.0]])
    table = confusable_classes(("wall", "door"), [("door", "wall")])
    hard = ClassWeighting(torch.ones(3), table)
    plain, margin = LossParams(margin=0.0), LossParams(margin=2.0)
    easy = alignment_loss(undecided, targets, texts, EVEN, margin)
    assert easy == alignment_loss(undecided, targets, texts, hard, plain)
    # Of two equal logits one is two nats higher: ln(1 + e^2) in place of ln 2.
    harder = alignment_loss(undecided, targets, texts, hard, margin)
    assert (harder - easy).item() == pytest.approx(np.log((1 + np.e**2) / 2), abs=1e-3)


def test_pairs_are_symmetric_and_names_that_are_missing_are_left_out() -> None:
    table = confusable_classes(("wall", "door", "cup"), [("door", "wall"), ("cup", "piano")])
    np.testing.assert_array_equal(table.numpy(), [[0, 1, 0], [1, 0, 0], [0, 0, 0]])
