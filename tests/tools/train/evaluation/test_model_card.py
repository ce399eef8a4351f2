"""The model card states the figures of its evaluation."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from onemap_tools.train.evaluation.model_card import model_card
from onemap_tools.train.evaluation.plots import CONFUSION_FILE, RELIABILITY_FILE
from onemap_tools.train.rounds import TrainingRound

FACTS = dict.fromkeys(
    ("parameters", "encode_ms", "words", "neutral", "temperature"),
    1,
)
ROUND = TrainingRound(steps=70, seed=3, pictures=640, apartments=40, frozen_stride=4)


def part(accuracy: float) -> dict[str, Any]:
    """The evaluation of one set of frames; a tenth of the sofas is taken for walls."""
    words = {"r_precision": 0.75, "auroc_mean_over_words": 0.875, "auroc_pooled": 0.625}
    return {
        "frames": 7,
        "pixel_accuracy": accuracy,
        "miou": 0.5,
        "names": words,
        "held_out_aliases": words,
        "detector": {"precision": 0.25, "recall": 0.125, "wrong_per_picture": 2.0},
        "calibration_error": 0.0625,
        "iou_by_class": {"sofa": 0.4, "wall": 0.6},
        "class_names": ["wall", "sofa"],
        "confusion": [[100, 0], [10, 90]],
        "miou_of_perfect_patches": 0.875,
        "iou_of_perfect_patches": {"sofa": 0.75, "wall": 1.0},
        "best_answer": {
            "calibration_error": 0.03125,
            "sure": 0.5,
            "wrong_of_sure": 0.25,
            "strangers": {"stranger": {"patches": 9, "sure": 0.3}},
        },
        "reliability": [{"stated": 0.1, "right": 0.2, "count": 5.0}],
    }


def evaluation() -> dict[str, Any]:
    return {
        "encoder_id": "mini-1234",
        "facts": FACTS,
        "held_out": part(0.9),
        "other_style": part(0.8),
        "validation": part(0.7),
    }


def test_the_card_says_what_the_network_was_trained_with() -> None:
    card = " ".join(model_card(evaluation(), (ROUND,)).split())
    assert "frames of 40 procedural apartments (640 pictures" in card
    assert "up to stride 4, stayed as they were. 70 steps from seed 3, and a tenth" in card
    further = replace(ROUND, seed=5, frozen_stride=2)
    both = " ".join(model_card(evaluation(), (ROUND, further)).split())
    assert "up to stride 2, stayed as they were. Rounds, each from" in both
    assert "70 steps from seed 3, up to stride 4 frozen; 70 steps from seed 5, up to" in both


def test_the_card_states_the_figures() -> None:
    card = model_card(evaluation(), (ROUND,), "Notes on this training.")
    assert "encoder `mini-1234`" in card
    assert "| pixel accuracy | 0.900 | 0.800 | 0.700 |" in card
    assert "| R-precision, class names | 0.750 | 0.750 | 0.750 |" in card
    assert "| pictures | 7 | 7 | 7 |" in card
    assert "sofa 0.40, wall 0.60" in card
    assert "calibration error of the best answer | 0.031 |" in card
    assert "the validation style 0.30 of the patches of things without a name have a" in card
    assert "a mIoU of 0.88 (lowest: sofa 0.75, wall 1.00)" in card
    first = card.split("| of the pixels of | are taken for | share |")[1].splitlines()[2]
    assert first == "| sofa | wall | 0.10 |"
    assert "| 0.10 | 0.20 | 5 |" in card
    assert f"]({CONFUSION_FILE})" in card
    assert f"]({RELIABILITY_FILE})" in card
    assert card.rstrip().endswith("Notes on this training.")
